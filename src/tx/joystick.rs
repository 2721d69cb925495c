//! Infrared remotes.

use crate::transfer_area::{
    FishX1Transfer, IrInput, IR_RECEIVER_IDX_ALL_DATA, IR_RECEIVER_IDX_OFF_OFF,
    IR_RECEIVER_IDX_OFF_ON, IR_RECEIVER_IDX_ON_OFF, IR_RECEIVER_IDX_ON_ON,
};

/// Which infrared remote, by its two DIP switches. Closed on purpose: there are no other settings.
#[doc(alias = "IrDev")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IrDevice {
    /// Any remote.
    #[doc(alias = "IR_ALL_DATA")]
    Any = IR_RECEIVER_IDX_ALL_DATA as isize,
    /// Switch 1 off, switch 2 off.
    #[doc(alias = "IR_OFF_OFF")]
    OffOff = IR_RECEIVER_IDX_OFF_OFF as isize,
    /// Switch 1 on, switch 2 off.
    #[doc(alias = "IR_ON_OFF")]
    OnOff = IR_RECEIVER_IDX_ON_OFF as isize,
    /// Switch 1 off, switch 2 on.
    #[doc(alias = "IR_OFF_ON")]
    OffOn = IR_RECEIVER_IDX_OFF_ON as isize,
    /// Switch 1 on, switch 2 on.
    #[doc(alias = "IR_ON_ON")]
    OnOn = IR_RECEIVER_IDX_ON_ON as isize,
}

impl IrDevice {
    /// All of them, in the order of [`ir_input`](crate::transfer_area::TxtInputs::ir_input).
    pub const ALL: [Self; 5] = [Self::Any, Self::OffOff, Self::OnOff, Self::OffOn, Self::OnOn];

    /// Its index in [`ir_input`](crate::transfer_area::TxtInputs::ir_input), 0..=4.
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// An axis of a joystick, −15..=15 with 0 in the middle. Closed on purpose: a remote has these four.
#[doc(alias = "IrAxisF")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JoystickAxis {
    /// Left joystick, left to right.
    #[doc(alias = "JoyLeftX")]
    LeftX,
    /// Left joystick, backwards to forward.
    #[doc(alias = "JoyLeftY")]
    LeftY,
    /// Right joystick, left to right.
    #[doc(alias = "JoyRightX")]
    RightX,
    /// Right joystick, backwards to forward.
    #[doc(alias = "JoyRightY")]
    RightY,
}

/// Half an axis of a joystick, 0 in the middle to 15. Closed on purpose: a remote has these eight.
#[doc(alias = "IrAxisP")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JoystickPart {
    /// Left joystick, how far to the left.
    #[doc(alias = "JoyLeftXtoLeft")]
    LeftXToLeft,
    /// Left joystick, how far to the right.
    #[doc(alias = "JoyLeftXtoRight")]
    LeftXToRight,
    /// Left joystick, how far forward.
    #[doc(alias = "JoyLeftYtoForward")]
    LeftYToForward,
    /// Left joystick, how far backwards.
    #[doc(alias = "JoyLeftYtoBackwards")]
    LeftYToBackwards,
    /// Right joystick, how far to the left.
    #[doc(alias = "JoyRightXtoLeft")]
    RightXToLeft,
    /// Right joystick, how far to the right.
    #[doc(alias = "JoyRightXtoRight")]
    RightXToRight,
    /// Right joystick, how far forward.
    #[doc(alias = "JoyRightYtoForward")]
    RightYToForward,
    /// Right joystick, how far backwards.
    #[doc(alias = "JoyRightYtoBackwards")]
    RightYToBackwards,
}

/// A button or DIP switch of an infrared remote. Closed on purpose: a remote has these four.
#[doc(alias = "IrButSwi")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JoystickSwitch {
    /// The ON button.
    #[doc(alias = "ButtonOn")]
    On,
    /// The OFF button.
    #[doc(alias = "ButtonOff")]
    Off,
    /// DIP switch 1. Sent only together with another change.
    #[doc(alias = "DipSwitch1")]
    Dip1,
    /// DIP switch 2. Sent only together with another change.
    #[doc(alias = "DipSwitch2")]
    Dip2,
}

impl FishX1Transfer {
    /// How far a joystick is moved in one of its four directions, 0..=15.
    #[doc(alias = "GetJoystickPart")]
    #[must_use]
    pub fn get_joystick_part(&self, device: IrDevice, part: JoystickPart) -> u16 {
        let remote = self.remote(device);
        match part {
            JoystickPart::LeftXToLeft => remote.joy_left_x_to_left,
            JoystickPart::LeftXToRight => remote.joy_left_x_to_right,
            JoystickPart::LeftYToForward => remote.joy_left_y_to_forward,
            JoystickPart::LeftYToBackwards => remote.joy_left_y_to_backwards,
            JoystickPart::RightXToLeft => remote.joy_right_x_to_left,
            JoystickPart::RightXToRight => remote.joy_right_x_to_right,
            JoystickPart::RightYToForward => remote.joy_right_y_to_forward,
            JoystickPart::RightYToBackwards => remote.joy_right_y_to_backwards,
        }
    }

    /// Where a joystick is on one of its axes, −15..=15.
    #[doc(alias = "GetJoystickFull")]
    #[must_use]
    pub fn get_joystick_full(&self, device: IrDevice, axis: JoystickAxis) -> i16 {
        let remote = self.remote(device);
        match axis {
            JoystickAxis::LeftX => remote.joy_left_x,
            JoystickAxis::LeftY => remote.joy_left_y,
            JoystickAxis::RightX => remote.joy_right_x,
            JoystickAxis::RightY => remote.joy_right_y,
        }
    }

    /// Whether a button of a remote is pressed, or a DIP switch is on.
    #[doc(alias = "GetJoystickButSwi")]
    #[must_use]
    pub fn get_joystick_but_swi(&self, device: IrDevice, switch: JoystickSwitch) -> bool {
        let remote = self.remote(device);
        let state = match switch {
            JoystickSwitch::On => remote.button_on,
            JoystickSwitch::Off => remote.button_off,
            JoystickSwitch::Dip1 => remote.dip_switch_1,
            JoystickSwitch::Dip2 => remote.dip_switch_2,
        };
        state != 0
    }

    fn remote(&self, device: IrDevice) -> &IrInput {
        &self.txt_inputs.ir_input[device.index()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All parts, in the order of their fields.
    const PARTS: [JoystickPart; 8] = [
        JoystickPart::LeftXToLeft,
        JoystickPart::LeftXToRight,
        JoystickPart::LeftYToForward,
        JoystickPart::LeftYToBackwards,
        JoystickPart::RightXToLeft,
        JoystickPart::RightXToRight,
        JoystickPart::RightYToForward,
        JoystickPart::RightYToBackwards,
    ];

    #[test]
    fn each_call_reads_its_own_field() {
        let mut area = FishX1Transfer::default();
        area.txt_inputs.ir_input[3] = IrInput {
            joy_left_x: -1,
            joy_left_x_to_left: 1,
            joy_left_x_to_right: 2,
            joy_left_y: -2,
            joy_left_y_to_forward: 3,
            joy_left_y_to_backwards: 4,
            joy_right_x: -3,
            joy_right_x_to_left: 5,
            joy_right_x_to_right: 6,
            joy_right_y: -4,
            joy_right_y_to_forward: 7,
            joy_right_y_to_backwards: 8,
            ..IrInput::default()
        };
        let device = IrDevice::OffOn;
        let parts = PARTS.map(|part| area.get_joystick_part(device, part));
        assert_eq!(parts, [1, 2, 3, 4, 5, 6, 7, 8]);
        let axes =
            [JoystickAxis::LeftX, JoystickAxis::LeftY, JoystickAxis::RightX, JoystickAxis::RightY];
        assert_eq!(axes.map(|axis| area.get_joystick_full(device, axis)), [-1, -2, -3, -4]);
        assert_eq!(axes.map(|axis| area.get_joystick_full(IrDevice::OnOff, axis)), [0; 4]);
    }

    #[test]
    fn each_button_and_switch_has_its_own_field() {
        use JoystickSwitch::{Dip1, Dip2, Off, On};
        for (pressed, remote) in [
            (On, IrInput { button_on: 1, ..IrInput::default() }),
            (Off, IrInput { button_off: 1, ..IrInput::default() }),
            (Dip1, IrInput { dip_switch_1: 1, ..IrInput::default() }),
            (Dip2, IrInput { dip_switch_2: 1, ..IrInput::default() }),
        ] {
            let mut area = FishX1Transfer::default();
            area.txt_inputs.ir_input[4] = remote;
            for switch in [On, Off, Dip1, Dip2] {
                let state = area.get_joystick_but_swi(IrDevice::OnOn, switch);
                assert_eq!(state, switch == pressed, "{switch:?} while {pressed:?} is on");
            }
        }
    }
}
