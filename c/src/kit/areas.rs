//! A program's own areas, and copies between them and those that go over the wire.

use ft_transfer_area::transfer_area::{FishX1Transfer, Timer};

use crate::memory::{Area, AreaArray, Cell, Places, AREAS};

/// Areas in the program's memory. They are read and written field by field, and only during calls.
pub(super) struct ProgramAreas {
    first: *mut FishX1Transfer,
    count: usize,
}

// SAFETY: the program promises that the areas stay, and who uses them when.
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
            array.store(to.config, load(from.config));
            array.store(to.config_id, load(from.config_id));
            // With the flags that the program has set back.
            array.store(to.input, load(from.input));
            array.store(to.output, load(from.output));
            array.store(to.txt_outputs, load(from.txt_outputs));
        }
    }

    /// Copies what the controller writes from the array, and sets the master's timers.
    pub(super) fn copy_from(&self, array: &AreaArray<FishX1Transfer>, timer: Timer) {
        for index in 0..self.count {
            let (from, to) = (array.places(index), self.places(index));
            store(to.input, array.load(from.input));
            store(to.txt_inputs, array.load(from.txt_inputs));
            store(to.txt_inputs2, array.load(from.txt_inputs2));
        }
        store(self.places(0).extensions, array.load(array.places(0).extensions));
        store(self.places(0).timer, timer);
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

/// Reads a value that [`places`](ProgramAreas::places) leads to.
fn load<T: Cell>(at: *mut T) -> T {
    // SAFETY: the place is in the program's areas, which are there during a call and have no references.
    unsafe { T::load(at) }
}

/// Writes a value that [`places`](ProgramAreas::places) leads to.
fn store<T: Cell>(at: *mut T, value: T) {
    // SAFETY: as above.
    unsafe { T::store(at, value) };
}
