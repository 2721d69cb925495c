//! A high-bay warehouse: brings containers from their shelves to the belt, and stores them again. The port of a whole C
//! program, `c/examples/warehouse.cpp`; `docs/porting.md` shows what has become of its parts.
//!
//! Wiring: the belt on M1 with light barriers on I1 (outside) and I4 (inside), the horizontal axis on M2 with C2 and its
//! reference switch on I5, the fork on M3 with switches on I6 (in) and I7 (out), the vertical axis on M4 with C4 and
//! its reference switch on I8, an infrared remote. OFF stops everything. Then the joysticks drive by hand, and ON lets
//! the program go on. ON also says that the workpiece was taken from the container outside; after five seconds it goes
//! in anyway.
//!
//! ```text
//! cargo run --example warehouse                           # a simulated TXT
//! cargo run --example warehouse -- 192.168.7.2 A2 C3      # a TXT on USB, and two shelves
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! `txt simulate --world high_bay_warehouse --show` shows the machine.

use std::env;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use ft_transfer_area::prelude::*;
use ft_transfer_area::tx::{InvalidCall, IrDevice, JoystickAxis, JoystickSwitch, Sound};
use ft_transfer_area_simulator::world::{Remote, Script, ScriptEvent, World};
use ft_transfer_area_simulator::SimulatedTxt;

/// In cycles of 10 ms: until a motor stands, of any step, until a container outside goes in again.
const SETTLING: u32 = 20;
const LONGEST: u32 = 2000;
const OFFERED: u32 = 500;
/// Of the joysticks, which go to 15.
const DEAD_ZONE: i16 = 4;

// Places in pulses from the reference switches. A larger row is lower.
const COLUMNS: [i32; 3] = [780, 1390, 1995];
const ROWS: [i32; 3] = [80, 445, 855];
const BELT_PLACE: (i32, i32) = (20, 720);
const LIFT: i32 = 40;

// All axes move to their first switch with a power above 0.
const BELT: Motor = M1;
const FORK: Motor = M3;
const OUTSIDE: Input = I1;
const INSIDE: Input = I4;
const FORK_IS_IN: Input = I6;
const FORK_IS_OUT: Input = I7;

#[derive(Clone, Copy, Debug)]
enum Travel {
    Stands,
    Searches,
    /// So many pulses; below 0 towards the switch.
    Travels(i32),
    /// It may run on by a few pulses, for so many cycles.
    Settles(i32, u32),
}

/// A motor with an encoder and a reference switch.
struct Axis {
    motor: Motor,
    counter: Counter,
    reference: Input,
    travel: Travel,
    /// In pulses from the reference switch.
    place: i32,
    /// Of all its ways.
    pulses: u32,
}

impl Axis {
    fn new(motor: Motor, counter: Counter, reference: Input) -> Self {
        Self { motor, counter, reference, travel: Travel::Stands, place: 0, pulses: 0 }
    }

    fn stands(&self) -> bool {
        matches!(self.travel, Travel::Stands)
    }

    fn search(&mut self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        area.stop_motor_ex_cmd(self.motor)?;
        self.travel = Travel::Searches;
        area.set_out_motor_power(self.motor, DUTY_MAX)
    }

    fn move_to(&mut self, area: &mut FishX1Transfer, place: i32) -> Result<(), InvalidCall> {
        let way = place - self.place;
        if way == 0 {
            self.travel = Travel::Stands;
            return Ok(());
        }
        self.travel = Travel::Travels(way);
        let direction = if way > 0 { Direction::Ccw } else { Direction::Cw };
        area.start_motor_ex_cmd(self.motor, DUTY_MAX, direction, &[], way.unsigned_abs())
    }

    fn stop(&mut self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        self.travel = Travel::Stands;
        area.stop_motor_ex_cmd(self.motor)
    }

    /// Once in each cycle.
    fn tick(&mut self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        match self.travel {
            Travel::Searches if area.get_in_io_value_binary(self.reference)? => {
                area.set_out_motor_power(self.motor, 0)?;
                self.place = 0;
                self.travel = Travel::Stands;
            }
            Travel::Travels(way) if area.is_motor_ex_ready(self.motor) => {
                area.set_out_motor_power(self.motor, 0)?;
                self.travel = Travel::Settles(way, SETTLING);
            }
            Travel::Settles(way, 1) => {
                let run = area.get_in_cnt_count(self.counter);
                self.place += way.signum() * i32::from(run);
                self.pulses += u32::from(run);
                self.travel = Travel::Stands;
            }
            Travel::Settles(way, cycles) => self.travel = Travel::Settles(way, cycles - 1),
            Travel::Stands | Travel::Searches | Travel::Travels(_) => {}
        }
        Ok(())
    }
}

#[derive(Clone, Copy)]
enum Action {
    /// So much lower.
    ToShelf(i32),
    ToBelt(i32),
    ForkOut,
    ForkIn,
    BeltOut,
    BeltIn,
    Offer,
}

/// What is done for an order: the action, the step with which it goes on after a stop, and its name.
const STEPS: [(Action, usize, &str); 19] = [
    (Action::ToShelf(0), 0, "to the shelf"),
    (Action::ForkOut, 0, "fork out"),
    (Action::ToShelf(-LIFT), 0, "lift"),
    (Action::ForkIn, 4, "fork in"),
    (Action::ToBelt(-LIFT), 4, "to the belt"),
    (Action::ForkOut, 4, "fork out"),
    (Action::ToBelt(LIFT), 4, "lower"),
    (Action::BeltOut, 7, "belt out"),
    (Action::ForkIn, 9, "fork in"),
    (Action::Offer, 9, "offer"),
    (Action::ToBelt(0), 10, "to the belt"),
    (Action::ForkOut, 10, "fork out"),
    (Action::BeltIn, 10, "belt in"),
    (Action::ToBelt(-LIFT), 10, "lift"),
    (Action::ForkIn, 15, "fork in"),
    (Action::ToShelf(-LIFT), 15, "to the shelf"),
    (Action::ForkOut, 15, "fork out"),
    (Action::ToShelf(LIFT), 15, "lower"),
    (Action::ForkIn, 18, "fork in"),
];

#[derive(Clone, Copy, Debug)]
struct Shelf {
    row: usize,
    column: usize,
}

impl FromStr for Shelf {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let none = || format!("there is no shelf {name}; there are A1 to C3");
        let [row, column] = name.as_bytes() else { return Err(none()) };
        let row = "ABC".find(char::from(row.to_ascii_uppercase())).ok_or_else(none)?;
        let column = "123".find(char::from(*column)).ok_or_else(none)?;
        Ok(Self { row, column })
    }
}

impl fmt::Display for Shelf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", ["A", "B", "C"][self.row], self.column + 1)
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    ForkHomes,
    AxesHome,
    Works,
    Stopped,
    Done,
}

struct Warehouse {
    mode: Mode,
    horizontal: Axis,
    vertical: Axis,
    orders: Vec<Shelf>,
    order: usize,
    /// Of the order; behind the last one before the first order.
    step: usize,
    /// Of the step.
    cycles: u32,
    on_before: bool,
    fetched: [[u32; 3]; 3],
    stops: u32,
    /// What is to be printed after the guard is dropped.
    said: Vec<String>,
}

impl Warehouse {
    fn new(orders: Vec<Shelf>, area: &mut FishX1Transfer) -> Result<Self, InvalidCall> {
        let mut warehouse = Self {
            mode: Mode::ForkHomes,
            horizontal: Axis::new(M2, C2, I5),
            vertical: Axis::new(M4, C4, I8),
            orders,
            order: 0,
            step: STEPS.len(),
            cycles: 0,
            on_before: false,
            fetched: Default::default(),
            stops: 0,
            said: Vec::new(),
        };
        warehouse.begin_homing(area)?;
        Ok(warehouse)
    }

    fn drive_to(&mut self, area: &mut FishX1Transfer, to: (i32, i32)) -> Result<(), InvalidCall> {
        self.horizontal.move_to(area, to.0)?;
        self.vertical.move_to(area, to.1)
    }

    fn begin_step(&mut self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        self.cycles = 0;
        let shelf = self.orders[self.order];
        match STEPS[self.step].0 {
            Action::ToShelf(lift) => {
                self.drive_to(area, (COLUMNS[shelf.column], ROWS[shelf.row] + lift))
            }
            Action::ToBelt(lift) => self.drive_to(area, (BELT_PLACE.0, BELT_PLACE.1 + lift)),
            Action::ForkOut => area.set_out_motor_power(FORK, -DUTY_MAX),
            Action::ForkIn => area.set_out_motor_power(FORK, DUTY_MAX),
            Action::BeltOut => area.set_out_motor_power(BELT, -DUTY_MAX),
            Action::BeltIn => area.set_out_motor_power(BELT, DUTY_MAX),
            Action::Offer => {
                self.said.push(format!("{shelf} is outside"));
                area.set_sound(Sound::Bell, 1)
            }
        }
    }

    /// Whether the step is done. Then what it has switched on is off again.
    fn step_is_done(
        &self,
        area: &mut FishX1Transfer,
        on_pressed: bool,
    ) -> Result<bool, InvalidCall> {
        // There is no light while something is in the way.
        let (motor, wanted) = match STEPS[self.step].0 {
            Action::ToShelf(_) | Action::ToBelt(_) => {
                return Ok(self.horizontal.stands() && self.vertical.stands());
            }
            Action::Offer => return Ok(on_pressed || self.cycles >= OFFERED),
            Action::ForkOut => (FORK, area.get_in_io_value_binary(FORK_IS_OUT)?),
            Action::ForkIn => (FORK, area.get_in_io_value_binary(FORK_IS_IN)?),
            Action::BeltOut => (BELT, !area.get_in_io_value_binary(OUTSIDE)?),
            Action::BeltIn => (BELT, !area.get_in_io_value_binary(INSIDE)?),
        };
        if wanted {
            area.set_out_motor_power(motor, 0)?;
        }
        Ok(wanted)
    }

    fn begin_order(&mut self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        let Some(shelf) = self.orders.get(self.order) else {
            self.mode = Mode::Done;
            return Ok(());
        };
        self.said.push(format!("fetching {shelf}"));
        self.step = 0;
        self.begin_step(area)
    }

    fn begin_homing(&mut self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        self.said.push("looking for the references".to_owned());
        self.cycles = 0;
        self.mode = Mode::ForkHomes;
        area.set_out_motor_power(FORK, DUTY_MAX)
    }

    fn stop_all(&mut self, area: &mut FishX1Transfer, reason: &str) -> Result<(), InvalidCall> {
        let step = STEPS.get(self.step).map_or("homing", |step| step.2);
        self.said.push(format!("stopped: {reason}, in step \"{step}\""));
        self.horizontal.stop(area)?;
        self.vertical.stop(area)?;
        area.set_out_motor_power(FORK, 0)?;
        area.set_out_motor_power(BELT, 0)?;
        self.stops += 1;
        self.mode = Mode::Stopped;
        area.set_sound(Sound::CarHornShort, 1)
    }

    fn hand_control(&self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        let joystick = |area: &FishX1Transfer, axis| {
            let value = area.get_joystick_full(IrDevice::Any, axis);
            // Near the middle it means 0.
            if value.abs() < DEAD_ZONE {
                0
            } else {
                value * DUTY_MAX / 15
            }
        };
        let fork = -joystick(area, JoystickAxis::LeftY); // up is out
        let fork = if fork < 0 && area.get_in_io_value_binary(FORK_IS_OUT)? { 0 } else { fork };
        for (motor, power, first_switch) in [
            (M2, -joystick(area, JoystickAxis::RightX), self.horizontal.reference),
            (M4, joystick(area, JoystickAxis::RightY), self.vertical.reference),
            (FORK, fork, FORK_IS_IN),
        ] {
            let is_at_switch = power > 0 && area.get_in_io_value_binary(first_switch)?;
            area.set_out_motor_power(motor, if is_at_switch { 0 } else { power })?;
        }
        Ok(())
    }

    /// One cycle: what the inputs say, what the outputs do, and what comes next.
    fn tick(&mut self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        let on = area.get_joystick_but_swi(IrDevice::Any, JoystickSwitch::On);
        let on_pressed = on && !self.on_before;
        self.on_before = on;
        self.cycles += 1;
        if !matches!(self.mode, Mode::Stopped | Mode::Done) {
            if area.get_joystick_but_swi(IrDevice::Any, JoystickSwitch::Off) {
                self.stop_all(area, "OFF was pressed")?;
            } else if self.cycles > LONGEST {
                self.stop_all(area, "it takes too long")?;
            }
        }
        self.horizontal.tick(area)?;
        self.vertical.tick(area)?;
        match self.mode {
            // Before the axes move.
            Mode::ForkHomes if area.get_in_io_value_binary(FORK_IS_IN)? => {
                area.set_out_motor_power(FORK, 0)?;
                self.horizontal.search(area)?;
                self.vertical.search(area)?;
                self.cycles = 0;
                self.mode = Mode::AxesHome;
            }
            Mode::AxesHome if self.horizontal.stands() && self.vertical.stands() => {
                self.mode = Mode::Works;
                if self.step == STEPS.len() {
                    self.begin_order(area)?;
                } else {
                    self.begin_step(area)?;
                }
            }
            Mode::Works if self.step_is_done(area, on_pressed)? => {
                self.step += 1;
                if self.step < STEPS.len() {
                    return self.begin_step(area);
                }
                let shelf = self.orders[self.order];
                self.said.push(format!("{shelf} is back"));
                self.fetched[shelf.row][shelf.column] += 1;
                self.order += 1;
                self.begin_order(area)?;
            }
            Mode::Stopped => {
                self.hand_control(area)?;
                if on_pressed {
                    self.horizontal.stop(area)?;
                    self.vertical.stop(area)?;
                    self.step = STEPS.get(self.step).map_or(self.step, |step| step.1);
                    self.begin_homing(area)?;
                }
            }
            Mode::ForkHomes | Mode::AxesHome | Mode::Works | Mode::Done => {}
        }
        Ok(())
    }
}

impl fmt::Display for Warehouse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "     1  2  3")?;
        for (name, [one, two, three]) in ["A", "B", "C"].iter().zip(self.fetched) {
            writeln!(f, "  {name}{one:3}{two:3}{three:3}")?;
        }
        let [horizontal, vertical] = [self.horizontal.pulses, self.vertical.pulses];
        let Self { order, orders, stops, .. } = self;
        let orders = orders.len();
        write!(f, "{order} of {orders} orders, {stops} stops, ")?;
        write!(f, "ways of {horizontal} and {vertical} pulses")
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shelves: Result<Vec<Shelf>, String> =
        env::args().skip(2).map(|name| name.parse()).collect();
    let mut orders = shelves?;
    if orders.is_empty() {
        orders = vec![Shelf { row: 0, column: 0 }];
    }
    // Without an address, a simulated TXT runs as long as the second value lives.
    let (address, _simulated) = controller()?;
    // The motors stop when the loop below hangs for two seconds.
    let builder = TransferAreaComHandler::builder(address).watchdog(Duration::from_secs(2));
    let handler = builder.build()?;
    let areas = handler.areas();
    for input in Input::ALL {
        areas.lock()[LOCAL_IO].set_ft_uni_config(input, InputMode::Resistance, true);
    }
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motors.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    let mut warehouse = Warehouse::new(orders, &mut areas.lock()[LOCAL_IO])?;
    while warehouse.mode != Mode::Done {
        let mut now = match areas.wait_cycle() {
            Err(Error::NotStarted) => break, // Ctrl-C
            cycle => cycle?,
        };
        warehouse.tick(&mut now[LOCAL_IO])?;
        // Printing is slow, and the outputs are sent after the guard is dropped.
        drop(now);
        warehouse.said.drain(..).for_each(|line| println!("{line}"));
    }
    // The last exchange stops the motors. An error that has ended the transfer is returned.
    handler.end_transfer()?;
    println!("{warehouse}");
    Ok(())
}

/// The controller on the command line, or a simulated TXT, which runs as long as the second value lives.
fn controller() -> Result<(String, Option<SimulatedTxt>), ft_transfer_area_simulator::Error> {
    if let Some(address) = env::args().nth(1) {
        return Ok((address, None));
    }
    println!(
        "No address is given, so this is a simulated warehouse. Its remote is used by a script."
    );
    let remote = |at, on| ScriptEvent::remote(at, Remote { on, ..Remote::default() });
    let script = Script::default().event(remote(18.0, true)).event(remote(18.5, false));
    let world = World::shipped("high_bay_warehouse")?;
    let world = world.remote(Remote::default()).script(script);
    let txt = SimulatedTxt::builder().world(world).start()?;
    Ok((txt.address().to_string(), Some(txt)))
}
