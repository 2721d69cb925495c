//! The camera: from the socket to the program, and from a frame to a picture.

mod clients;
mod decode;
mod peer;
mod stream;

use anyhow::Result;

pub(crate) use peer::CameraPeer;

use crate::report::Report;

pub(crate) fn measure(report: &Report) -> Result<()> {
    let controller = stream::Controller::start()?;
    stream::measure_throughput(report, &controller)?;
    stream::measure_latency(report, &controller)?;
    decode::measure_copies(report)?;
    stream::measure_load(report, &controller)?;
    decode::measure_decoders(report)
}
