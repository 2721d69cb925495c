//! Commands outside online mode, and how a request has to arrive.

use std::time::Duration;

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, QueryStatusResponse, UpdateConfig, ID_LEN,
};
use ft_transfer_area::FirmwareVersion;

use super::{Check, Found};
use crate::seen;
use crate::selftest::bench::Bench;
use crate::selftest::line::{Heard, Line};
use crate::selftest::outcome::Outcome;
use crate::selftest::session::{command, config_packet, packet};

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "query-status",
        "QueryStatus is answered by a name, filled with NUL, and the version.",
        query_status,
    ),
    Check::new("two-commands-at-once", "Two commands in one segment get two answers.", two_at_once),
    Check::new("unknown-command", "An unknown command closes the connection.", unknown),
    Check::new(
        "commands-before-start",
        "Before StartOnline, UpdateConfig, both exchanges and StopOnline are answered.",
        before_start,
    ),
    Check::new(
        "command-in-pieces",
        "A command that comes in pieces closes the connection, unless it is split after its id.",
        in_pieces,
    ),
    Check::new(
        "ports-before-start",
        "Before StartOnline, the ports of the camera and of I2C refuse connections.",
        closed_ports,
    ),
];

fn query_status(bench: &mut Bench) -> Found {
    let status = bench.status()?;
    let mut name = status.device_name.iter().skip_while(|byte| **byte != 0);
    let is_filled = name.all(|byte| *byte == 0);
    let is_same = is_filled && status.version >= FirmwareVersion::OLDEST_SUPPORTED;
    let seen = format!("{}, firmware {}", status.name(), status.version);
    Ok(Outcome::same_if(is_same, seen).with("version", status.version.to_string()))
}

fn two_at_once(bench: &mut Bench) -> Found {
    let request = packet(CommandId::QueryStatus).repeat(2);
    bench.main()?.ask(&request, 2 * QueryStatusResponse::LEN)?;
    Ok(Outcome::same_if(true, ""))
}

fn unknown(bench: &mut Bench) -> Found {
    let mut line = bench.main()?;
    line.send(&0x1234_5678_u32.to_le_bytes())?;
    closes(&mut line)
}

/// The controller is expected to close this connection now.
pub(super) fn closes(line: &mut Line) -> Found {
    Ok(match line.hear(1, Duration::from_secs(1))? {
        Heard::Closed => Outcome::same_if(true, ""),
        Heard::Silence => Outcome::differs("the connection stays open"),
        Heard::Bytes(_) => Outcome::differs("it is answered"),
    })
}

fn in_pieces(bench: &mut Bench) -> Found {
    const PAUSE: Duration = Duration::from_millis(300);

    let update = config_packet(1, Config::default());
    let (id, rest) = update.split_at(ID_LEN);
    let mut line = bench.main()?;
    line.send(id)?;
    bench.pause(PAUSE)?;
    line.ask(rest, ID_LEN).map_err(|trouble| trouble.during("split after its id"))?;
    // Only one connection is served.
    drop(line);
    let (start, rest) = update.split_at(UpdateConfig::LEN / 2);
    let mut line = bench.main()?;
    line.send(start)?;
    bench.pause(PAUSE)?;
    line.send(rest)?;
    closes(&mut line)
}

fn before_start(bench: &mut Bench) -> Found {
    // This stops a program that runs on the controller.
    bench.online()?;
    bench.end()?;
    let mut line = bench.main()?;
    outside(&mut line)?;
    Ok(Outcome::same_if(true, ""))
}

/// Commands that the firmware answers outside online mode, too. All outputs are 0.
pub(super) fn outside(line: &mut Line) -> Result<(), crate::selftest::outcome::Trouble> {
    command(line, CommandId::UpdateConfig, &config_packet(1, Config::default()))?;
    let mut simple = Vec::new();
    ExchangeData::default().emit(&mut simple);
    command(line, CommandId::ExchangeData, &simple)?;
    let mut data = Vec::new();
    let crc = Compressor::new().compress(&[0; 27], &mut data);
    let extra_size = data.len() as u32;
    let mut compressed = Vec::new();
    CmprHeader { extra_size, crc, active_extensions: 0 }.emit_command(&mut compressed);
    compressed.extend(data);
    let header = command(line, CommandId::ExchangeDataCmpr, &compressed)?;
    let rest = CommandId::ExchangeDataCmpr.response().size(&header);
    line.receive(rest.map_or(0, |size| size - header.len()))?;
    command(line, CommandId::StopOnline, &packet(CommandId::StopOnline))?;
    Ok(())
}

fn closed_ports(bench: &mut Bench) -> Found {
    // The session of a check before has ended properly, so it has left no server behind.
    bench.end()?;
    let ports = [seen::Line::Camera, seen::Line::I2c];
    let mut open = Vec::new();
    for port in ports {
        if bench.connect(port)?.is_some() {
            open.push(port.name());
        }
    }
    let seen = if open.is_empty() { String::new() } else { format!("open: {}", open.join(", ")) };
    Ok(Outcome::same_if(open.is_empty(), seen))
}
