//! Events, as they are recorded.

use ft_transfer_area::{Event, TimedEvent};

use crate::format::RecordedEvent;

/// An event of a response; `None` for those that come from no response.
pub(crate) fn recorded(
    told: &TimedEvent,
    controller: impl Fn(usize) -> String,
) -> Option<RecordedEvent> {
    let (area, terminal, value) = match told.event {
        Event::InputChanged { area, input, pressed, .. } => {
            (area, input.to_string(), pressed.into())
        }
        Event::CounterChanged { area, counter, count, .. } => {
            (area, counter.to_string(), count.into())
        }
        Event::CounterReset { area, counter, command_id, .. } => {
            (area, counter.to_string(), command_id.into())
        }
        Event::MotorReached { area, motor, position, .. }
        | Event::MotorStalled { area, motor, position, .. } => {
            (area, motor.to_string(), position.into())
        }
        Event::JoystickMoved { area, device, joystick, x, .. } => {
            (area, format!("{device:?}.{joystick:?}"), x.into())
        }
        Event::ExtensionChanged { extension, alive, .. } => {
            (extension, String::new(), alive.into())
        }
        _ => return None,
    };
    let y = match told.event {
        Event::JoystickMoved { y, .. } => Some(y.into()),
        _ => None,
    };
    Some(RecordedEvent {
        event: format!("{:?}", told.event.kind()),
        controller: controller(area),
        terminal,
        value,
        y,
        cycle: told.cycle,
    })
}
