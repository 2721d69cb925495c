//! A frame of the display as block characters.

/// Pixels of the display.
pub(super) const WIDTH: usize = 128;
const HEIGHT: usize = 64;
/// Bytes of a frame: eight pixels each, one below the other, the lowest bit on top; a row of bytes from left
/// to right, then the next eight rows of pixels.
pub(super) const FRAME_BYTES: usize = WIDTH * HEIGHT / 8;

/// A frame as the program has drawn it.
pub(super) type Frame = [u8; FRAME_BYTES];

fn pixel(frame: &Frame, x: usize, y: usize) -> usize {
    usize::from(frame[y / 8 * WIDTH + x] >> (y % 8) & 1)
}

/// The lines of a frame, each of `WIDTH` characters, or of half as many where there is no place for them.
pub(super) fn lines(frame: &Frame, columns: usize) -> Vec<String> {
    if columns >= WIDTH {
        blocks::<1>(frame, &[' ', '▀', '▄', '█'])
    } else {
        const QUARTERS: &[char] =
            &[' ', '▘', '▝', '▀', '▖', '▌', '▞', '▛', '▗', '▚', '▐', '▜', '▄', '▙', '▟', '█'];
        blocks::<2>(frame, QUARTERS)
    }
}

/// Two pixels high, and `ACROSS` wide, makes a character. The upper pixels are its lower bits.
fn blocks<const ACROSS: usize>(frame: &Frame, characters: &[char]) -> Vec<String> {
    let character = |x, y| {
        let mut bits = 0;
        for below in 0..2 {
            for right in 0..ACROSS {
                bits |= pixel(frame, x + right, y + below) << (below * ACROSS + right);
            }
        }
        characters[bits]
    };
    let line = |y| (0..WIDTH).step_by(ACROSS).map(|x| character(x, y)).collect();
    (0..HEIGHT).step_by(2).map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_become_blocks() {
        let mut frame = [0; FRAME_BYTES];
        frame[0] = 0b0000_0111; // x 0, y 0 to 2
        frame[1] = 0b0000_0010; // x 1, y 1
        frame[FRAME_BYTES - 1] = 0b1000_0000; // the last pixel
        let wide = lines(&frame, 200);
        assert_eq!((wide.len(), wide[0].chars().count()), (32, 128));
        assert!(wide[0].starts_with("█▄ ") && wide[1].starts_with("▀ "), "{wide:?}");
        assert!(wide[31].ends_with(" ▄"));
        let narrow = lines(&frame, 80);
        assert_eq!((narrow.len(), narrow[0].chars().count()), (32, 64));
        assert!(narrow[0].starts_with("▙ ") && narrow[1].starts_with("▘ "), "{narrow:?}");
        assert!(narrow[31].ends_with(" ▗"));
    }
}
