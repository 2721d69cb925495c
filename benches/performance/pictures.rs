//! Frames as a camera sends them: without the end marker and Huffman tables, with garbage at the end.

use std::time::Duration;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use ft_transfer_area::{CameraFrame, CameraOptions, TransferAreaComHandler};
use ft_transfer_area_simulator::SimulatedTxt;
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Motif {
    /// The simulated TXT's test card: large areas of one colour, so there is little to decode.
    TestCard,
    /// Fine texture everywhere, as of a carpet: about as large as a picture of a camera gets.
    Texture,
}

/// Kind and size of pictures.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Format {
    #[arg(long, value_enum)]
    pub(crate) motif: Motif,
    #[arg(long)]
    pub(crate) width: u16,
    #[arg(long)]
    pub(crate) height: u16,
}

impl Format {
    pub(crate) const fn new(motif: Motif, width: u16, height: u16) -> Self {
        Self { motif, width, height }
    }

    pub(crate) fn name(self) -> String {
        let motif = match self.motif {
            Motif::TestCard => "test card",
            Motif::Texture => "texture",
        };
        format!("{motif}, {}×{}", self.width, self.height)
    }

    /// The arguments for another process.
    pub(crate) fn arguments(self) -> Vec<String> {
        let motif = match self.motif {
            Motif::TestCard => "test-card",
            Motif::Texture => "texture",
        };
        let [width, height] = [self.width, self.height].map(|side| side.to_string());
        ["--motif", motif, "--width", &width, "--height", &height].map(str::to_owned).to_vec()
    }

    /// The first frame of a simulated TXT.
    pub(crate) fn frame(self) -> Result<CameraFrame> {
        let mut txt = SimulatedTxt::builder().camera_tables(false).camera_start_up(Duration::ZERO);
        if self.motif == Motif::Texture {
            let picture = texture(self.width, self.height)?;
            txt = txt.on_exchange(move |machine| machine.set_camera_picture(Some(picture.clone())));
        }
        let txt = txt.start()?;
        let handler = TransferAreaComHandler::builder(txt.address())
            .camera_port(txt.camera_port())
            .build()?;
        handler.begin_transfer()?;
        handler.areas().wait_cycle()?;
        let options = CameraOptions::default().size(self.width, self.height);
        let frames = handler.start_camera(options)?;
        frames.recv().context("the simulated camera sends no frame")
    }
}

/// A JPEG file of noise on a slope.
fn texture(width: u16, height: u16) -> Result<Vec<u8>> {
    /// How far a sample is from the slope at most.
    const NOISE: u32 = 16;
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) % (2 * NOISE)
    };
    let mut samples = Vec::new();
    for y in 0..u32::from(height) {
        for x in 0..u32::from(width) {
            let across = x * 128 / u32::from(width);
            let down = y * 128 / u32::from(height);
            let grain = noise();
            // At most 223, so each fits.
            samples.extend([64 + across, 64 + down, 128].map(|slope| (slope + grain) as u8));
        }
    }
    let mut jpeg = Vec::new();
    let mut encoder = Encoder::new(&mut jpeg, 85);
    encoder.set_sampling_factor(SamplingFactor::F_2_1);
    encoder.encode(&samples, width, height, ColorType::Rgb)?;
    Ok(jpeg)
}
