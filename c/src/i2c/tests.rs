use ft_transfer_area::TimeLimits;
use ft_transfer_area_simulator::SimulatedTxt;

use super::*;

const LIMIT: Duration = Duration::from_secs(10);
/// 8 bits of address, 8 bits of data.
const BYTES: u8 = 0b01_01;
/// Kept open, at 400 kHz.
const OPEN_AND_FAST: u8 = 1 << 4 | 1 << 7;

fn new(device: u8, offset: u32, protocol: u8) -> Result<Request, u32> {
    Request::new(device, offset, protocol, Access::Read)
}

#[test]
fn wrong_devices_and_flags_are_refused() {
    for device in [128, 255, 80, 84] {
        assert_eq!(new(device, 0, BYTES), Err(FTLIB_I2C_INVALID_DEV_ADDR));
    }
    for protocol in 0..=u8::MAX {
        let expected = match (protocol >> 2 & 3, protocol >> 5 & 3) {
            (0, _) => Some(FTLIB_I2C_C_INVALID_FLAGS_DATAMODE),
            (_, 3) => Some(FTLIB_I2C_C_INVALID_FLAGS_ERRMODE),
            _ => None,
        };
        assert_eq!(new(24, 7, protocol).err(), expected, "{protocol:#010b}");
    }
    for (mode, max) in [(1, 0xFF), (2, 0xFFFF), (3, 0xFFFF)] {
        assert!(new(24, max, 4 | mode).is_ok());
        assert_eq!(new(24, max + 1, 4 | mode), Err(FTLIB_I2C_C_INVALID_FLAGS_ADDRMODE));
    }
    assert!(new(24, u32::MAX, 4).is_ok(), "there is no address");
}

#[test]
fn addresses_and_values_have_the_order_of_their_flags() {
    let write = |protocol| Request::new(24, 0x12, protocol, Access::Write(0x3456)).unwrap().write;
    assert_eq!(write(0b01_00), [0x56]);
    assert_eq!(write(0b01_01), [0x12, 0x56]);
    assert_eq!(write(0b10_10), [0, 0x12, 0x34, 0x56]);
    assert_eq!(write(0b11_11), [0x12, 0, 0x56, 0x34]);
}

fn thread_for(txt: &SimulatedTxt) -> I2cThread {
    let port = txt.i2c_port();
    let connect = move || I2cClient::connect(format!("127.0.0.1:{port}"), TimeLimits::default());
    I2cThread::start("here", connect).unwrap()
}

/// Where the result of a request comes in.
fn ask(thread: &I2cThread, request: Request) -> Receiver<(u16, u16)> {
    let (sender, receiver) = mpsc::channel();
    let done = Box::new(move |value, status| sender.send((value, status)).unwrap_or_default());
    thread.request(request, Box::new(|| true), done).unwrap();
    receiver
}

#[test]
fn values_are_written_and_read() {
    let txt = SimulatedTxt::builder().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[5..7].copy_from_slice(&[0x12, 0x34]));
    let thread = thread_for(&txt);
    let read = |protocol| {
        let request = Request::new(0x18, 5, protocol, Access::Read).unwrap();
        ask(&thread, request).recv_timeout(LIMIT)
    };
    assert_eq!(read(0b01_01), Ok((0x12, I2C_SUCCESS)));
    assert_eq!(read(0b10_01), Ok((0x1234, I2C_SUCCESS)));
    assert_eq!(read(OPEN_AND_FAST | 0b11_01), Ok((0x3412, I2C_SUCCESS)));
    let request = Request::new(0x18, 5, 0b10_01, Access::Write(0x5678)).unwrap();
    assert_eq!(ask(&thread, request).recv_timeout(LIMIT), Ok((0x5678, I2C_SUCCESS)));
    let registers = txt.with_machine(|machine| machine.i2c_device(0x18)[5..7].to_vec());
    assert_eq!(registers, [0x56, 0x78]);
}

#[test]
fn a_read_without_an_address_goes_on_where_the_device_is() {
    let txt = SimulatedTxt::builder().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[5..8].copy_from_slice(&[0x12, 0x34, 0x56]));
    let thread = thread_for(&txt);
    for (protocol, value) in [(BYTES, 0x12), (0b10_00, 0x3456)] {
        let request = Request::new(0x18, 5, protocol, Access::Read).unwrap();
        assert_eq!(ask(&thread, request).recv_timeout(LIMIT), Ok((value, I2C_SUCCESS)));
    }
}

#[test]
fn an_error_is_reported_or_the_request_repeated_until_it_works() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let thread = thread_for(&txt);
    for (access, error) in [(Access::Read, I2C_READ_ERROR), (Access::Write(1), I2C_WRITE_ERROR)] {
        for protocol in [BYTES, BYTES | 1 << 5] {
            let request = Request::new(0x18, 5, protocol, access).unwrap();
            assert_eq!(ask(&thread, request).recv_timeout(LIMIT), Ok((0, error)));
        }
    }
    let request = Request::new(0x18, 5, BYTES | 2 << 5, Access::Read).unwrap();
    let result = ask(&thread, request);
    assert_eq!(result.recv_timeout(PAUSE * 20), Err(mpsc::RecvTimeoutError::Timeout));
    txt.with_machine(|machine| machine.i2c_device(0x18)[5] = 9);
    assert_eq!(result.recv_timeout(LIMIT), Ok((9, I2C_SUCCESS)));
}

#[test]
fn the_end_gives_up_what_waits_and_what_is_repeated() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let thread = thread_for(&txt);
    let for_ever = Request::new(0x18, 5, BYTES | 2 << 5, Access::Read).unwrap();
    let results = [ask(&thread, for_ever.clone()), ask(&thread, for_ever)];
    drop(thread);
    for result in results {
        assert_eq!(result.recv_timeout(LIMIT), Err(mpsc::RecvTimeoutError::Disconnected));
    }
}

#[test]
fn too_many_requests_are_refused() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let thread = thread_for(&txt);
    let for_ever = Request::new(0x18, 5, BYTES | 2 << 5, Access::Read).unwrap();
    let request = || thread.request(for_ever.clone(), Box::new(|| true), Box::new(|_, _| {}));
    // One may be carried out already.
    let refused = (0..WAITING + 2).filter_map(|_| request().err()).next();
    assert_eq!(refused, Some(FTLIB_ERR_NO_MEMORY));
}
