//! The picture: a test card with colour bars, a moving bar and the number of the frame.

use jpeg_encoder::{rgb_to_ycbcr, ImageBuffer, JpegColorType};

/// The colour bars from left to right in RGB, at three quarters of full brightness, so that the
/// white bar is easy to see.
const BARS: [[u8; 3]; 8] = [
    [191, 191, 191],
    [191, 191, 0],
    [0, 191, 191],
    [0, 191, 0],
    [191, 0, 191],
    [191, 0, 0],
    [0, 0, 191],
    [0, 0, 0],
];
const WHITE: [u8; 3] = [255; 3];
const BLACK: [u8; 3] = [0; 3];

/// The number of blocks along the bottom, one per bit of the frame's number.
const BLOCKS: usize = 16;

/// The number of frames in which the white bar crosses the picture.
const CROSSING: u64 = 64;

/// The number of digits.
const DIGITS: usize = 5;

/// Height and width of a digit in cells.
const DIGIT_SIZE: (usize, usize) = (5, 3);

/// Height and width of the panel in cells: the digits with a cell around each.
const PANEL_SIZE: (usize, usize) = (DIGIT_SIZE.0 + 2, DIGITS * (DIGIT_SIZE.1 + 1) + 1);

/// The digits: rows of cells from top to bottom, the left cell in the highest of 3 bits.
const FONT: [[u8; DIGIT_SIZE.0]; 10] = [
    [0b111, 0b101, 0b101, 0b101, 0b111],
    [0b010, 0b110, 0b010, 0b010, 0b111],
    [0b111, 0b001, 0b111, 0b100, 0b111],
    [0b111, 0b001, 0b011, 0b001, 0b111],
    [0b101, 0b101, 0b111, 0b001, 0b001],
    [0b111, 0b100, 0b111, 0b001, 0b111],
    [0b111, 0b100, 0b111, 0b101, 0b111],
    [0b111, 0b001, 0b001, 0b010, 0b010],
    [0b111, 0b101, 0b111, 0b101, 0b111],
    [0b111, 0b101, 0b111, 0b001, 0b111],
];

/// The picture of one frame.
pub(super) struct TestCard {
    layout: Layout,
    /// Y, Cb and Cr of the lines that differ, in the order of [`Line::index`].
    lines: Vec<[Vec<u8>; 3]>,
}

impl TestCard {
    /// Draws the picture of the frame with this number. Width and height are at least 1.
    pub(super) fn new(width: u16, height: u16, number: u64) -> Self {
        let layout = Layout::new(width, height);
        let pen = Pen { layout, number };
        let lines = Line::all().map(|line| pen.draw(line)).collect();
        Self { layout, lines }
    }
}

impl ImageBuffer for TestCard {
    fn get_jpeg_color_type(&self) -> JpegColorType {
        JpegColorType::Ycbcr
    }

    fn width(&self) -> u16 {
        self.layout.width
    }

    fn height(&self) -> u16 {
        self.layout.height
    }

    fn fill_buffers(&self, y: u16, buffers: &mut [Vec<u8>; 4]) {
        let line = &self.lines[self.layout.line(y.into()).index()];
        for (buffer, samples) in buffers.iter_mut().zip(line) {
            buffer.extend_from_slice(samples);
        }
    }
}

/// What a line of pixels shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Line {
    /// The bars only.
    Bars,
    /// This row of cells of the panel, and the bars beside it.
    Panel(usize),
    /// The blocks.
    Blocks,
}

impl Line {
    fn all() -> impl Iterator<Item = Self> {
        [Self::Bars, Self::Blocks].into_iter().chain((0..PANEL_SIZE.0).map(Self::Panel))
    }

    /// Its index among all lines.
    fn index(self) -> usize {
        match self {
            Self::Bars => 0,
            Self::Blocks => 1,
            Self::Panel(row) => 2 + row,
        }
    }
}

/// The layout of the picture, in pixels.
#[derive(Clone, Copy, Debug)]
struct Layout {
    width: u16,
    height: u16,
    /// The first row of the blocks.
    blocks_top: usize,
    /// Width and height of a cell; 0 when there is no room for digits.
    cell: usize,
    /// The upper left corner of the panel.
    panel_left: usize,
    panel_top: usize,
}

impl Layout {
    fn new(width: u16, height: u16) -> Self {
        let [columns, rows] = [width, height].map(usize::from);
        let blocks_top = rows.saturating_sub((rows / 8).max(2));
        let cell = (columns / (PANEL_SIZE.1 + 3)).min(blocks_top / (2 * PANEL_SIZE.0));
        Self {
            width,
            height,
            blocks_top,
            cell,
            panel_left: (columns - cell * PANEL_SIZE.1) / 2,
            panel_top: (blocks_top - cell * PANEL_SIZE.0) / 2,
        }
    }

    /// What the line at this height shows.
    fn line(&self, y: usize) -> Line {
        if y >= self.blocks_top {
            return Line::Blocks;
        }
        let row = y.checked_sub(self.panel_top).and_then(|inside| inside.checked_div(self.cell));
        row.filter(|row| *row < PANEL_SIZE.0).map_or(Line::Bars, Line::Panel)
    }

    /// The column of the panel's cells that this pixel is in.
    fn panel_column(&self, x: usize) -> Option<usize> {
        let inside = x.checked_sub(self.panel_left)?;
        inside.checked_div(self.cell).filter(|column| *column < PANEL_SIZE.1)
    }
}

/// Draws the lines of one frame.
struct Pen {
    layout: Layout,
    number: u64,
}

impl Pen {
    /// Y, Cb and Cr of a line.
    fn draw(&self, line: Line) -> [Vec<u8>; 3] {
        let width = usize::from(self.layout.width);
        let mut planes = [(); 3].map(|()| Vec::with_capacity(width));
        for x in 0..width {
            let [red, green, blue] = self.colour(x, line);
            let (luma, blueness, redness) = rgb_to_ycbcr(red, green, blue);
            for (plane, sample) in planes.iter_mut().zip([luma, blueness, redness]) {
                plane.push(sample);
            }
        }
        planes
    }

    fn colour(&self, x: usize, line: Line) -> [u8; 3] {
        let lit = match (line, self.layout.panel_column(x)) {
            (Line::Blocks, _) => self.block(x),
            (Line::Panel(row), Some(column)) => self.cell(row, column),
            (Line::Bars, _) | (Line::Panel(_), None) => return self.bars(x),
        };
        if lit {
            WHITE
        } else {
            BLACK
        }
    }

    /// The colour bars, and the white bar in front of them.
    fn bars(&self, x: usize) -> [u8; 3] {
        let width = usize::from(self.layout.width);
        let left = width * (self.number % CROSSING) as usize / CROSSING as usize;
        // The part that leaves on the right comes back on the left.
        if (x + width - left) % width < (width / 16).max(1) {
            return WHITE;
        }
        BARS[x * BARS.len() / width]
    }

    /// Whether the block at this pixel is white.
    fn block(&self, x: usize) -> bool {
        // Block i begins at i * width / BLOCKS, rounded down.
        let block = ((x + 1) * BLOCKS - 1) / usize::from(self.layout.width);
        self.number >> (BLOCKS - 1 - block) & 1 == 1
    }

    /// Whether the panel's cell is white.
    fn cell(&self, row: usize, column: usize) -> bool {
        let (Some(row), Some(column)) = (row.checked_sub(1), column.checked_sub(1)) else {
            return false;
        };
        let (index, column) = (column / (DIGIT_SIZE.1 + 1), column % (DIGIT_SIZE.1 + 1));
        if row >= DIGIT_SIZE.0 || column >= DIGIT_SIZE.1 || index >= DIGITS {
            return false;
        }
        FONT[self.digit(index)][row] >> (DIGIT_SIZE.1 - 1 - column) & 1 == 1
    }

    /// A digit of the number that the blocks show, the first on the left.
    fn digit(&self, index: usize) -> usize {
        let divisor = 10_usize.pow((DIGITS - 1 - index) as u32);
        usize::from(self.number as u16) / divisor % 10
    }
}

#[cfg(test)]
mod tests {
    use jpeg_decoder::Decoder;

    use super::super::frame::frame;
    use super::*;

    /// The Y samples of a line.
    fn luma(card: &TestCard, y: u16) -> Vec<u8> {
        let mut buffers = [(); 4].map(|()| Vec::new());
        card.fill_buffers(y, &mut buffers);
        assert!(buffers[..3].iter().all(|buffer| buffer.len() == usize::from(card.width())));
        let [luma, ..] = buffers;
        luma
    }

    /// The number that the blocks of a decoded picture show.
    fn number_shown(rgb: &[u8], width: usize, height: usize) -> u16 {
        let y = height - 1 - height / 16;
        let white = |block: usize| {
            let x = block * width / 16 + width / 32;
            rgb[3 * (y * width + x) + 1] >= 128
        };
        (0..BLOCKS).fold(0, |number, block| number << 1 | u16::from(white(block)))
    }

    #[test]
    fn the_blocks_survive_the_encoder_at_any_size() {
        let sizes = [(16, 16), (17, 31), (160, 120), (333, 77), (16, 4096), (4096, 16)];
        for (width, height) in sizes {
            for number in [0, 1, 0x5555, 0xAAAA, 0x8000, 0xFFFF, 0x1234, 0x1_0002] {
                let card = TestCard::new(width, height, number);
                let mut jpeg = frame(card, number, true).unwrap();
                jpeg.truncate(jpeg.len() - 40);
                jpeg.extend([0xFF, 0xD9]);
                let rgb = Decoder::new(jpeg.as_slice()).decode().unwrap();
                let shown = number_shown(&rgb, width.into(), height.into());
                assert_eq!(shown, number as u16, "{width} × {height}");
            }
        }
    }

    #[test]
    fn the_digits_show_the_number_of_the_blocks() {
        let pen = Pen { layout: Layout::new(320, 240), number: 65_536 + 40_321 };
        assert_eq!([0, 1, 2, 3, 4].map(|index| pen.digit(index)), [4, 0, 3, 2, 1]);
        let row = |row| -> String {
            let cells = (0..PANEL_SIZE.1).map(|column| pen.cell(row, column));
            cells.map(|lit| if lit { '#' } else { '.' }).collect()
        };
        let panel = [
            ".....................",
            ".#.#.###.###.###..#..",
            ".#.#.#.#...#...#.##..",
            ".###.#.#..##.###..#..",
            "...#.#.#...#.#....#..",
            "...#.###.###.###.###.",
            ".....................",
        ];
        assert_eq!([0, 1, 2, 3, 4, 5, 6].map(row), panel);
    }

    #[test]
    fn the_white_bar_moves_on_with_every_frame_and_wraps() {
        let lefts = [0, 1, 2, 62, 64, 65].map(|number| {
            let luma = luma(&TestCard::new(640, 480, number), 0);
            assert_eq!(luma.iter().filter(|sample| **sample == 255).count(), 40);
            luma.iter().position(|sample| *sample == 255)
        });
        assert_eq!(lefts, [0, 10, 20, 0, 0, 10].map(Some));
        let luma = luma(&TestCard::new(640, 480, 62), 0);
        assert_eq!((luma[619], luma[620], luma[19], luma[20]), (0, 255, 255, 191));
    }

    #[test]
    fn there_is_a_picture_of_any_size() {
        for (width, height) in [(1, 1), (1, 4096), (4096, 1), (15, 2), (4096, 4096)] {
            let card = TestCard::new(width, height, u64::MAX);
            for y in 0..height {
                luma(&card, y);
            }
        }
    }
}
