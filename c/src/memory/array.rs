//! The nine areas of one device, at a place that stays.

use std::alloc::{alloc_zeroed, dealloc, handle_alloc_error, Layout};
use std::cell::UnsafeCell;
use std::mem::MaybeUninit;
use std::ptr::NonNull;

use ft_transfer_area::transfer_area::{
    Change, Config, FishX1Transfer, Info, InputValues, OutputValues, Status, Timer, TxtInputs,
    TxtInputs2, TxtOutputs, MAX_AREAS,
};

use super::cells::Cell;
use super::ta::Ta;

/// How many areas a program sees, whether the extensions are there or not.
pub(crate) const AREAS: usize = MAX_AREAS;

/// Where the parts of one area lie.
#[derive(Clone, Copy)]
pub(crate) struct Places {
    pub(crate) info: *mut Info,
    pub(crate) dev_mode: *mut u8,
    pub(crate) id: *mut u8,
    pub(crate) config_id: *mut u8,
    pub(crate) extensions: *mut [u8; 8],
    pub(crate) config: *mut Config,
    pub(crate) input: *mut InputValues,
    pub(crate) output: *mut OutputValues,
    pub(crate) status: *mut Status,
    pub(crate) change: *mut Change,
    pub(crate) timer: *mut Timer,
    pub(crate) txt_inputs: *mut TxtInputs,
    pub(crate) txt_outputs: *mut TxtOutputs,
    pub(crate) txt_inputs2: *mut TxtInputs2,
}

/// A kind of area: what a program's header makes of it.
///
/// # Safety
///
/// All bits 0 are a valid area, and [`places`](Self::places) lead into the area that is given.
pub(crate) unsafe trait Area: 'static {
    /// Whether `motor_ex_reached` is set for a distance only, which is the target that was reached, as on the TX.
    /// On a TXT a command without one is done at once, and sets it, too.
    const REACHED_IS_A_DISTANCE: bool;
    /// Whether 0 is the normal mode of a counter and 1 the inverted one, as on the TX. On a TXT it is the
    /// other way round.
    const COUNTERS_NORMAL_AT_0: bool;

    /// Where the parts of an area lie. Computes addresses, and reads nothing.
    ///
    /// # Safety
    ///
    /// `area` points to an area.
    unsafe fn places(area: *mut Self) -> Places;
}

macro_rules! places {
    ($area:ident, $dev_mode:ident, $extensions:ident) => {
        // SAFETY: as the caller promises; no reference is made.
        unsafe {
            Places {
                info: &raw mut (*$area).info,
                dev_mode: &raw mut (*$area).state.$dev_mode,
                id: &raw mut (*$area).state.id,
                config_id: &raw mut (*$area).state.config_id,
                extensions: &raw mut (*$area).state.$extensions,
                config: &raw mut (*$area).config,
                input: &raw mut (*$area).input,
                output: &raw mut (*$area).output,
                status: &raw mut (*$area).status,
                change: &raw mut (*$area).change,
                timer: &raw mut (*$area).timer,
                txt_inputs: &raw mut (*$area).txt_inputs,
                txt_outputs: &raw mut (*$area).txt_outputs,
                txt_inputs2: &raw mut (*$area).txt_inputs2,
            }
        }
    };
}

// SAFETY: integers and pointers, for which all bits 0 are valid; the places are those of its fields.
unsafe impl Area for Ta {
    const REACHED_IS_A_DISTANCE: bool = true;
    const COUNTERS_NORMAL_AT_0: bool = true;

    unsafe fn places(area: *mut Self) -> Places {
        places!(area, dev_mode, ext_dev_connect_state)
    }
}

// SAFETY: integers only; the places are those of its fields.
unsafe impl Area for FishX1Transfer {
    const REACHED_IS_A_DISTANCE: bool = false;
    const COUNTERS_NORMAL_AT_0: bool = false;

    unsafe fn places(area: *mut Self) -> Places {
        places!(area, io_mode, io_slave_alive)
    }
}

/// Nine areas that a program and this library share. They stay where they are until this is dropped.
pub(crate) struct AreaArray<A: Area> {
    first: NonNull<A>,
    /// Whether its memory was allocated.
    is_allocated: bool,
}

/// The areas of a program for the TXT itself, from its beginning to its end. All bits are 0 at first.
static OF_PROGRAM: OfProgram = OfProgram(UnsafeCell::new(MaybeUninit::zeroed()));

#[repr(transparent)]
struct OfProgram(UnsafeCell<MaybeUninit<[FishX1Transfer; AREAS]>>);

// SAFETY: it is reached by atomic accesses and from C only.
unsafe impl Sync for OfProgram {}

/// Where the areas of a program for the TXT itself are, also before they are used.
pub(crate) fn areas_of_program() -> *mut FishX1Transfer {
    OF_PROGRAM.0.get().cast()
}

// SAFETY: the memory belongs to it alone, and is reached by atomic accesses only.
unsafe impl<A: Area> Send for AreaArray<A> {}
// SAFETY: as above.
unsafe impl<A: Area> Sync for AreaArray<A> {}

impl<A: Area> AreaArray<A> {
    const LAYOUT: Layout = Layout::new::<[A; AREAS]>();

    /// Areas with the default configuration.
    pub(crate) fn new() -> Self {
        // SAFETY: the layout is not empty.
        let memory = unsafe { alloc_zeroed(Self::LAYOUT) }.cast::<A>();
        let Some(first) = NonNull::new(memory) else { handle_alloc_error(Self::LAYOUT) };
        let array = Self { first, is_allocated: true };
        let mut default = FishX1Transfer::default();
        if A::COUNTERS_NORMAL_AT_0 {
            default.config.cnt.iter_mut().for_each(|counter| counter.mode = 0);
        }
        for index in 0..AREAS {
            let places = array.places(index);
            array.store(places.config, default.config);
            array.store(places.config_id, default.state.config_id);
            array.store(places.id, index as u8);
        }
        array
    }

    /// Makes all bits 0.
    pub(crate) fn clear(&self) {
        for index in 0..Self::LAYOUT.size() / size_of::<u32>() {
            self.store(self.as_ptr().cast::<u32>().wrapping_add(index), 0);
        }
    }

    /// Where the program finds them.
    pub(crate) fn as_ptr(&self) -> *mut A {
        self.first.as_ptr()
    }

    /// Where the parts of an area lie.
    ///
    /// # Panics
    ///
    /// When there is no such area.
    pub(crate) fn places(&self, index: usize) -> Places {
        assert!(index < AREAS, "there is no area {index}");
        // SAFETY: the area lies within the array.
        unsafe { A::places(self.as_ptr().add(index)) }
    }

    /// Reads a value that [`places`](Self::places) of this array leads to.
    pub(crate) fn load<T: Cell>(&self, at: *mut T) -> T {
        self.check(at);
        // SAFETY: it lies within the array, which is reached by atomic accesses and from C only.
        unsafe { T::load(at) }
    }

    /// Writes a value that [`places`](Self::places) of this array leads to.
    pub(crate) fn store<T: Cell>(&self, at: *mut T, value: T) {
        self.check(at);
        // SAFETY: it lies within the array, which is reached by atomic accesses and from C only.
        unsafe { T::store(at, value) };
    }

    /// Makes the two above safe whatever they are given: the value lies within the array, at a place for
    /// its type.
    fn check<T>(&self, at: *mut T) {
        let (first, at) = (self.as_ptr() as usize, at as usize);
        let end = first + Self::LAYOUT.size() - size_of::<T>();
        assert!((first..=end).contains(&at) && at % align_of::<T>() == 0, "not in the areas");
    }
}

impl AreaArray<FishX1Transfer> {
    /// Those at [`areas_of_program`].
    pub(crate) fn of_program() -> Self {
        // SAFETY: the address of a static is not null.
        let first = unsafe { NonNull::new_unchecked(areas_of_program()) };
        Self { first, is_allocated: false }
    }
}

impl<A: Area> Drop for AreaArray<A> {
    fn drop(&mut self) {
        if self.is_allocated {
            // SAFETY: it was allocated with this layout.
            unsafe { dealloc(self.as_ptr().cast(), Self::LAYOUT) };
        }
    }
}
