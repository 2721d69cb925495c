//! A program's own areas, and copies between them and those that go over the wire.

use ft_transfer_area::transfer_area::{FishX1Transfer, InputValues, Timer};

use crate::memory::{Area, AreaArray, Cell, Places, AREAS};
use crate::mirror::settled;

/// Areas in the program's memory. They are read and written field by field, during calls and by the thread of
/// kit 4.6.6.
pub(super) struct ProgramAreas {
    first: *mut FishX1Transfer,
    count: usize,
}

// SAFETY: the program promises that the areas stay.
unsafe impl Send for ProgramAreas {}
// SAFETY: as above; the fields are reached by atomic accesses.
unsafe impl Sync for ProgramAreas {}

impl ProgramAreas {
    /// `None` for a null pointer, one that is not aligned, or a wrong number of areas.
    ///
    /// # Safety
    ///
    /// `first` is null or points to `count` areas, which stay there as long as this.
    pub(super) unsafe fn new(first: *mut FishX1Transfer, count: i32) -> Option<Self> {
        let count = usize::try_from(count).ok().filter(|count| (1..=AREAS).contains(count))?;
        (!first.is_null() && first.is_aligned()).then_some(Self { first, count })
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Makes all of them areas with the default configuration. What they held before is not read.
    pub(super) fn clear(&self) {
        for index in 0..self.count {
            let mut area = FishX1Transfer::default();
            area.state.id = index as u8;
            // SAFETY: the area lies within those of the program.
            unsafe { self.first.add(index).write(area) };
        }
    }

    /// Copies what the program writes into the array.
    pub(super) fn copy_to(&self, array: &AreaArray<FishX1Transfer>) {
        for index in 0..self.count {
            let (from, to) = (self.places(index), array.places(index));
            // The id first: the program raises it when the configuration is written.
            array.store(to.config_id, load(from.config_id));
            array.store(to.config, load(from.config));
            // The program may run meanwhile, with the thread of kit 4.6.6.
            array.store(to.output, settled(|| load(from.output)));
            array.store(to.txt_outputs, load(from.txt_outputs));
        }
    }

    /// Copies the newest outputs into the array: a command that was given since they were sent is not done yet.
    pub(super) fn copy_newest_to(&self, array: &AreaArray<FishX1Transfer>) {
        for index in 0..self.count {
            array.store(array.places(index).output, load(self.places(index).output));
        }
    }

    /// Runs what may set flags in the array, and sets these in the program's areas, too, whatever the program has set
    /// back meanwhile.
    pub(super) fn with_flags(&self, array: &AreaArray<FishX1Transfer>, set: impl FnOnce()) {
        let in_array = |index| flags(array.places(index).input);
        (0..self.count).flat_map(in_array).for_each(|flags| array.store(flags, [0; 4]));
        set();
        for index in 0..self.count {
            let pairs = in_array(index).into_iter().zip(flags(self.places(index).input));
            for (from, to) in pairs {
                let is_set = array.load(from);
                for i in (0..4).filter(|i| is_set[*i] != 0) {
                    store(to.cast::<u16>().wrapping_add(i), 1);
                }
            }
        }
    }

    /// Copies the inputs without their flags and ids from the array, and sets the master's timers.
    pub(super) fn copy_values_from(&self, array: &AreaArray<FishX1Transfer>, timer: Timer) {
        for index in 0..self.count {
            let (from, to) = (array.places(index), self.places(index));
            let input = array.load(from.input);
            // SAFETY: computes addresses within the inputs only.
            unsafe {
                store(&raw mut (*to.input).uni, input.uni);
                store(&raw mut (*to.input).cnt_in, input.cnt_in);
                store(&raw mut (*to.input).counter, input.counter);
            }
            store(to.txt_inputs, array.load(from.txt_inputs));
            store(to.txt_inputs2, array.load(from.txt_inputs2));
        }
        store(self.places(0).extensions, array.load(array.places(0).extensions));
        store(self.places(0).timer, timer);
    }

    /// Copies which commands are done. Last, because a program that sees an id also looks at the rest.
    pub(super) fn copy_ids_from(&self, array: &AreaArray<FishX1Transfer>) {
        for index in 0..self.count {
            let (input, to) = (array.load(array.places(index).input), self.places(index).input);
            // SAFETY: computes addresses within the inputs only.
            unsafe {
                store(&raw mut (*to).cnt_reset_cmd_id, input.cnt_reset_cmd_id);
                store(&raw mut (*to).motor_ex_cmd_id, input.motor_ex_cmd_id);
            }
        }
    }

    /// Reads what is printed of an area.
    pub(super) fn read(&self, index: usize) -> FishX1Transfer {
        let places = self.places(index);
        let mut area = FishX1Transfer::default();
        area.state.id = load(places.id);
        area.input = load(places.input);
        area.output = load(places.output);
        area
    }

    fn places(&self, index: usize) -> Places {
        assert!(index < self.count, "the program has no area {index}");
        // SAFETY: the area lies within those of the program.
        unsafe { FishX1Transfer::places(self.first.add(index)) }
    }
}

/// Where the flags of commands that are done lie in the inputs.
fn flags(input: *mut InputValues) -> [*mut [u16; 4]; 2] {
    // SAFETY: computes addresses within the inputs only.
    unsafe {
        [(&raw mut (*input).cnt_resetted).cast(), (&raw mut (*input).motor_ex_reached).cast()]
    }
}

/// Reads a value that [`places`](ProgramAreas::places) leads to.
fn load<T: Cell>(at: *mut T) -> T {
    // SAFETY: the place is in the program's areas, which stay as long as the handler and have no references.
    unsafe { T::load(at) }
}

/// Writes a value that [`places`](ProgramAreas::places) leads to.
fn store<T: Cell>(at: *mut T, value: T) {
    // SAFETY: as above.
    unsafe { T::store(at, value) };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flag_that_is_set_back_during_an_exchange_is_set_when_the_command_is_done() {
        let mut area = FishX1Transfer::default();
        area.input.cnt_resetted[0] = 1;
        area.input.motor_ex_reached = [1; 4].into();
        // SAFETY: it stays until the end of this test.
        let program = unsafe { ProgramAreas::new(&raw mut area, 1) }.unwrap();
        let array = AreaArray::new();
        program.copy_to(&array);
        let [of_reset, of_motors] = flags(program.places(0).input);
        store(of_reset, [0; 4]);
        store(of_motors, [0, 1, 0, 1]);
        program.with_flags(&array, || {
            let [resets, motors] = flags(array.places(0).input);
            array.store(resets.cast::<u16>(), 1);
            array.store(motors.cast::<u16>().wrapping_add(2), 1);
        });
        assert_eq!((load(of_reset), load(of_motors)), ([1, 0, 0, 0], [0, 1, 1, 1]));
    }
}
