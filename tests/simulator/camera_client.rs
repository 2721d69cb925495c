//! The client's end of a camera connection, made by hand.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, TcpStream};

use ft_transfer_area::wire::{
    CameraFrameHeader, CommandId, ResponseId, StartCameraOnline, CAMERA_FRAME_ACKNOWLEDGE,
};
use ft_transfer_area_simulator::SimulatedTxt;
use jpeg_decoder::{Decoder, PixelFormat};

use crate::wire_client::{Client, LIMIT};

/// How many bytes of garbage the simulated camera sends after a picture.
const GARBAGE_SIZE: usize = 40;

pub(crate) struct Frame {
    pub(crate) header: CameraFrameHeader,
    /// The bytes as received.
    pub(crate) bytes: Vec<u8>,
}

impl Frame {
    /// The picture as in a file.
    pub(crate) fn jpeg(&self) -> Vec<u8> {
        let mut jpeg = self.bytes[..self.bytes.len() - GARBAGE_SIZE].to_vec();
        jpeg.extend([0xFF, 0xD9]);
        jpeg
    }

    /// The number that the picture shows.
    pub(crate) fn number(&self) -> u16 {
        number_shown(&self.jpeg())
    }
}

/// The number that the blocks along the bottom edge of the picture show.
pub(crate) fn number_shown(jpeg: &[u8]) -> u16 {
    let mut decoder = Decoder::new(jpeg);
    let rgb = decoder.decode().unwrap();
    let info = decoder.info().unwrap();
    assert_eq!(info.pixel_format, PixelFormat::RGB24);
    let [width, height] = [info.width, info.height].map(usize::from);
    let y = height - 1 - height / 16;
    (0..16).fold(0, |number, block| {
        let x = block * width / 16 + width / 32;
        let green = rgb[3 * (y * width + x) + 1];
        number << 1 | u16::from(green >= 128)
    })
}

pub(crate) struct CameraClient {
    pub(crate) stream: TcpStream,
}

impl CameraClient {
    /// Connects, whether the camera serves or not.
    pub(crate) fn connect(txt: &SimulatedTxt) -> Self {
        Self::over(TcpStream::connect((Ipv4Addr::LOCALHOST, txt.camera_port())).unwrap())
    }

    /// The client's end of a connection.
    pub(crate) fn over(stream: TcpStream) -> Self {
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        stream.set_nodelay(true).unwrap();
        Self { stream }
    }

    pub(crate) fn receive(&mut self) -> Frame {
        let mut header = [0; CameraFrameHeader::LEN];
        self.stream.read_exact(&mut header).unwrap();
        let header = CameraFrameHeader::parse(&header).unwrap();
        let mut bytes = vec![0; usize::try_from(header.size_compressed).unwrap()];
        self.stream.read_exact(&mut bytes).unwrap();
        Frame { header, bytes }
    }

    pub(crate) fn acknowledge(&mut self) {
        self.stream.write_all(&CAMERA_FRAME_ACKNOWLEDGE).unwrap();
    }

    /// Reads until the other side closes the connection. Returns how many bytes came before.
    pub(crate) fn until_closed(mut self) -> u64 {
        match io::copy(&mut self.stream, &mut io::sink()) {
            Ok(count) => count,
            // This error comes when it closes with our bytes unread.
            Err(error) if error.kind() == io::ErrorKind::ConnectionReset => 0,
            Err(error) => panic!("the connection was not closed: {error}"),
        }
    }
}

/// The command that asks for pictures of this size and rate.
pub(crate) fn settings(width: i32, height: i32, framerate: i32) -> StartCameraOnline {
    StartCameraOnline { width, height, framerate, power_line_frequency: 50 }
}

impl Client {
    pub(crate) fn start_camera(&mut self, settings: StartCameraOnline) {
        let mut out = Vec::new();
        settings.emit(&mut out);
        self.send(&out);
        ResponseId::StartCameraOnline.check(&self.receive(4)).unwrap();
    }

    pub(crate) fn stop_camera(&mut self) {
        self.command(CommandId::StopCameraOnline);
        ResponseId::StopCameraOnline.check(&self.receive(4)).unwrap();
    }
}
