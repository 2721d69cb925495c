//! Inputs, timers and changes.

use std::ptr::null_mut;
use std::thread;
use std::time::{Duration, Instant};

use super::api::*;
use super::bench::*;

#[test]
fn values_are_read_with_their_overrun_in_both_exchanges() {
    let library = initialized();
    library.in_both_exchanges(|txt, device| {
        let modes = [(0, false), (1, false), (3, false), (2, false), (1, true), (3, false)];
        for (input, (mode, digital)) in (0..).zip(modes) {
            assert_eq!(SetFtUniConfig(device.0, 0, input, mode, digital), SUCCESS);
        }
        let read = |input| {
            let (mut value, mut overrun) = (-1, 77);
            assert_eq!(GetInIOValue(device.0, 0, input, &mut value, &mut overrun), SUCCESS);
            (value, overrun)
        };
        let values = [10_000, 5000, 1024, 5000, 1, 4096, 0, 0];
        txt.with_machine(|it| it.controllers[0].uni = values);
        wait("the inputs", || device.input(0).uni == values);
        let read_all: Vec<_> = (0..6).map(read).collect();
        assert_eq!(read_all, [(10_000, 1), (5000, 1), (1024, 1), (5000, 0), (1, 0), (4096, 1)]);
        let values = [9999, 4999, 1023, 0, 0, 0, 0, 0];
        txt.with_machine(|it| it.controllers[0].uni = values);
        wait("the inputs", || device.input(0).uni == values);
        assert_eq!([read(0), read(1), read(2)], [(9999, 0), (4999, 0), (1023, 0)]);
    });
}

#[test]
fn counters_and_buttons_are_read() {
    let library = initialized();
    library.in_both_exchanges(|_, device| {
        assert_eq!(SetOutMotorValues(device.0, 0, 3, 512, 0), SUCCESS);
        let (mut count, mut level) = (0, -1);
        wait("pulses", || {
            assert_eq!(GetInCounterValue(device.0, 0, 3, &mut count, &mut level), SUCCESS);
            count > 5
        });
        assert!(level == 0 || level == 1);
        let (mut left, mut right) = (-1, -1);
        assert_eq!(GetInDisplayButtonValue(device.0, 0, &mut left, &mut right), SUCCESS);
        assert_eq!((left, right), (0, 0));
        for wrong in [
            GetInIOValue(device.0, 0, 0, null_mut(), &mut 0),
            GetInIOValue(device.0, 0, 0, &mut 0, null_mut()),
            GetInCounterValue(device.0, 0, 0, null_mut(), &mut 0),
            GetInCounterValue(device.0, 0, 0, &mut 0, null_mut()),
            GetInDisplayButtonValue(device.0, 0, null_mut(), &mut 0),
            GetInDisplayButtonValue(device.0, 0, &mut 0, null_mut()),
        ] {
            assert_eq!(wrong, INVALID_PARAM);
        }
    });
}

/// A published program copies the area every 20 ms, and looks only at inputs that are marked. Its recordings with the
/// original library, whose exchanges over Bluetooth took that long, have each change.
#[test]
fn a_program_that_looks_every_20_ms_sees_each_change() {
    let _library = initialized();
    let txt = txt();
    let device = Device::open(&txt);
    device.start();
    let look = || {
        // SAFETY: the device is open; a program reads its areas so.
        let marks = unsafe { (&raw const (*device.area(0)).change).read_volatile() };
        (marks.change_uni & 0b10 != 0, device.input(0).uni[1])
    };
    let mut in_time = 0;
    for value in 1..=200 {
        wait("a quiet cycle", || !look().0);
        txt.with_machine(|it| it.controllers[0].uni[1] = value);
        let (mut longest, mut marked, mut before) = (Duration::ZERO, false, Instant::now());
        // Once more after the value is there, because the mark is written after it.
        let mut further = 2;
        while further > 0 {
            thread::sleep(Duration::from_millis(20));
            longest = longest.max(before.elapsed());
            before = Instant::now();
            let (mark, now) = look();
            marked |= mark;
            further -= u8::from(now == value);
        }
        // On a busy computer a look comes later.
        if longest < Duration::from_millis(29) {
            assert!(
                marked,
                "change {value} was not marked at a look {longest:?} after the one before"
            );
            in_time += 1;
        }
        if in_time == 20 {
            return;
        }
    }
}

#[test]
fn the_area_tells_what_has_changed_and_what_time_it_is() {
    let _library = initialized();
    let txt = txt();
    let device = Device::open(&txt);
    device.start();
    // SAFETY: the device is open; a program reads its areas so.
    let change = || unsafe { (&raw const (*device.area(0)).change).read_volatile() };
    // SAFETY: as above.
    let timer = || unsafe { (&raw const (*device.area(0)).timer).read_volatile() };
    wait("a quiet cycle", || change().change_status == 0);
    // A new value with each exchange, so there is time to see it.
    let mut value = 0;
    wait("changes of I2 and I8 only", || {
        value = (value + 1) % 4000;
        txt.with_machine(|it| {
            it.controllers[0].uni[1] = value;
            it.controllers[0].uni[7] = value;
        });
        change().change_uni == 0b1000_0010
    });
    let before = timer().timer_10ms;
    wait("half a second", || timer().timer_10ms.wrapping_sub(before) >= 50);
    // SAFETY: the device is open; a program reads its areas so.
    let dev_mode = unsafe { (&raw const (*device.area(0)).state.dev_mode).read_volatile() };
    assert_eq!(dev_mode, 1);
}
