//! What the steps of a cycle cost by themselves, without a socket.

use std::hint::black_box;

use anyhow::Result;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::wire::{crc_of_words, Compressor, Expander};
use ft_transfer_area::{Exchange, FirmwareVersion, FishX1Transfer, TransferAreaComHandler};

use crate::clients::Load;
use crate::peer::Canned;
use crate::pictures::{Format, Motif};
use crate::report::{Report, Table};
use crate::rounds::{alternate, quickest, shown, Work};

/// Words of the master's part of a request, and of a response.
const WORD_COUNTS: [usize; 2] = [27, 52];

const SIZES: [(u16, u16); 2] = [(320, 240), (640, 480)];

pub(crate) fn measure(report: &Report) -> Result<()> {
    let mut works = Vec::new();
    for count in WORD_COUNTS {
        add_words(&mut works, count)?;
    }
    for areas in [1, 2, 9] {
        for changing in [false, true] {
            add_exchange(&mut works, Load { areas, changing, simple: false })?;
        }
    }
    let handler = TransferAreaComHandler::builder("127.0.0.1").build()?;
    works.push(Work::new("lock and drop, without a transfer", move || {
        black_box(handler.areas().lock()[LOCAL_IO].input.uni[0])
    }));
    for (width, height) in SIZES {
        add_picture(&mut works, Format::new(Motif::TestCard, width, height))?;
    }
    let times = alternate(report, "micro", report.times(200, 2), &mut works)?;
    let mut table = Table::new(["what", "time", "the quickest round"]);
    for (work, times) in works.iter().zip(&times) {
        table.row([work.name.clone(), shown(times), quickest(times)]);
    }
    report.table("micro", &table)
}

/// What two packets in turn have in common.
#[derive(Clone, Copy)]
enum Change {
    Nothing,
    ThreeWords,
    AllWords,
}

impl Change {
    const ALL: [Self; 3] = [Self::Nothing, Self::ThreeWords, Self::AllWords];

    fn name(self) -> &'static str {
        match self {
            Self::Nothing => "unchanged",
            Self::ThreeWords => "3 of them changed",
            Self::AllWords => "all of them changed",
        }
    }

    /// The words of two packets that differ this much.
    fn packets(self, count: usize) -> [Vec<u16>; 2] {
        let first: Vec<u16> = (0..count).map(|index| 1000 + index as u16).collect();
        let mut second = first.clone();
        for (index, word) in second.iter_mut().enumerate() {
            let changes = match self {
                Self::Nothing => false,
                // Apart, so that there are runs between them.
                Self::ThreeWords => [2, 10, 20].contains(&index),
                Self::AllWords => true,
            };
            *word += if changes { 500 } else { 0 };
        }
        [first, second]
    }
}

/// Adds what is done to the words of a packet.
fn add_words(works: &mut Vec<Work>, count: usize) -> Result<()> {
    for change in Change::ALL {
        let what = format!("{count} words, {}", change.name());
        works.push(compress(format!("compress {what}"), change.packets(count)));
        works.push(expand(format!("expand {what}"), &change.packets(count))?);
    }
    let [words, _] = Change::AllWords.packets(count);
    works.push(Work::new(format!("CRC of {count} words"), move || crc_of_words(black_box(&words))));
    Ok(())
}

fn compress(name: String, packets: [Vec<u16>; 2]) -> Work {
    let mut compressor = Compressor::new();
    let mut out = Vec::new();
    let mut turn = 0;
    Work::new(name, move || {
        turn ^= 1;
        out.clear();
        let crc = compressor.compress(black_box(&packets[turn]), &mut out);
        black_box(&out);
        crc
    })
}

fn expand(name: String, packets: &[Vec<u16>; 2]) -> Result<Work> {
    let count = packets[0].len();
    let mut compressor = Compressor::new();
    let mut compressed = || {
        [0, 1].map(|turn| {
            let mut data = Vec::new();
            let crc = compressor.compress(&packets[turn], &mut data);
            (data, crc)
        })
    };
    let mut expander = Expander::new();
    // The first packets differ from words that are 0.
    for (data, crc) in compressed() {
        expander.expand(&data, count, crc)?;
    }
    let packets = compressed();
    let mut turn = 1;
    Ok(Work::new(name, move || {
        turn ^= 1;
        let (data, crc) = &packets[turn];
        expander.expand(black_box(data), count, *crc).map(|words| words[0])
    }))
}

/// Adds what is done without a socket in each cycle.
fn add_exchange(works: &mut Vec<Work>, load: Load) -> Result<()> {
    let areas = match load.areas {
        1 => "1 area".to_owned(),
        count => format!("{count} areas"),
    };
    let what = format!("{areas}, {}", if load.changing { "all words change" } else { "idle" });
    let Canned { exchanges: [first, responses @ ..], .. } = Canned::new(&load)?;
    let begun = || -> Result<Exchange> {
        let mut exchange = Exchange::new(load.mode(), FirmwareVersion::new(4, 6, 6));
        exchange.receive(&first)?;
        Ok(exchange)
    };
    let mut exchange = begun()?;
    let outputs = [0, 1].map(|number| {
        let mut areas = vec![FishX1Transfer::default(); load.areas];
        load.change(&mut areas, number);
        areas
    });
    let mut request = Vec::new();
    let mut turn = 0;
    works.push(Work::new(format!("request of {what}"), move || {
        turn ^= 1;
        exchange.request(black_box(&outputs[turn]), &mut request)
    }));
    let mut exchange = begun()?;
    let mut inputs = vec![FishX1Transfer::default(); load.areas];
    let mut turn = 1;
    works.push(Work::new(format!("response of {what}"), move || {
        turn ^= 1;
        let received = exchange.receive(black_box(&responses[turn]));
        received.map(|received| received.apply(black_box(&mut inputs))).is_ok()
    }));
    Ok(())
}

fn add_picture(works: &mut Vec<Work>, format: Format) -> Result<()> {
    let frame = format.frame()?;
    // Whether it can be done, before it is timed.
    frame.to_rgb()?;
    let again = frame.clone();
    let name = format.name();
    works.push(Work::new(format!("`jpeg` (repair) of a {name}"), move || {
        black_box(&frame).jpeg().map(|jpeg| jpeg.len())
    }));
    works.push(Work::new(format!("`to_rgb` of a {name}"), move || black_box(&again).to_rgb()));
    Ok(())
}
