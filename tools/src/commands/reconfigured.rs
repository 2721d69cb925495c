//! Inputs that were configured anew: what they show until the controller has measured as they are configured now.

use ft_transfer_area::transfer_area::UniConfig;
use ft_transfer_area::tx::Input;
use ft_transfer_area::FishX1Transfer;

/// How many more responses may come from an exchange that began before the change.
const UNDER_WAY: u64 = 1;

/// Inputs of a transfer that were changed a moment ago. In the areas they have a 0 that nobody has measured, or a value of
/// the configuration before.
#[derive(Default)]
pub(crate) struct Reconfigured {
    /// The number of the newest response.
    cycle: u64,
    held: Vec<Held>,
}

struct Held {
    area: usize,
    input: Input,
    before: Shown,
    /// The last response that may not be measured as it is configured now.
    until: u64,
}

/// An input's configuration, and what was measured with it.
type Shown = (UniConfig, i16);

fn shown(area: &FishX1Transfer, input: Input) -> Shown {
    (area.config.uni[input.index()], area.input.uni[input.index()])
}

impl Reconfigured {
    /// Changes areas that show response `cycle`.
    pub(crate) fn change<T>(
        &mut self,
        areas: &mut [FishX1Transfer],
        cycle: u64,
        change: impl FnOnce(&mut [FishX1Transfer]) -> T,
    ) -> T {
        self.cycle = cycle;
        self.held.retain(|held| cycle <= held.until);
        let before: Vec<[Shown; 8]> =
            areas.iter().map(|area| Input::ALL.map(|input| shown(area, input))).collect();
        let done = change(areas);
        for (area, (before, after)) in before.iter().zip(&*areas).enumerate() {
            for (input, before) in Input::ALL.into_iter().zip(before) {
                if *before != shown(after, input) {
                    self.hold(area, input, *before);
                }
            }
        }
        done
    }

    fn hold(&mut self, area: usize, input: Input, before: Shown) {
        let until = self.cycle + UNDER_WAY;
        let held = self.held.iter_mut().find(|held| (held.area, held.input) == (area, input));
        match held {
            Some(held) => held.until = until,
            None => self.held.push(Held { area, input, before, until }),
        }
    }

    /// Whether an input may not be measured yet as it is configured now.
    pub(crate) fn has(&self, area: usize, input: Input) -> bool {
        self.held.iter().any(|held| (held.area, held.input) == (area, input))
    }

    /// Puts what these inputs showed before into a copy of the areas, with the configuration of then.
    pub(crate) fn show_before(&self, copy: &mut [FishX1Transfer]) {
        for Held { area, input, before: (config, value), .. } in &self.held {
            if let Some(area) = copy.get_mut(*area) {
                area.config.uni[input.index()] = *config;
                area.input.uni[input.index()] = *value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::transfer_area::InputMode;

    use super::*;

    /// What a page shows of I3 in this response, which brings a value.
    fn shown_in(
        reconfigured: &mut Reconfigured,
        areas: &mut [FishX1Transfer],
        (cycle, value): (u64, i16),
        mode: Option<InputMode>,
    ) -> (Option<InputMode>, i16) {
        areas[0].input.uni[2] = value;
        reconfigured.change(areas, cycle, |areas| {
            if let Some(mode) = mode {
                areas[0].set_ft_uni_config(Input::I3, mode, false);
            }
        });
        let mut copy = areas.to_vec();
        reconfigured.show_before(&mut copy);
        (copy[0].config.uni[2].input_mode(), copy[0].input.uni[2])
    }

    #[test]
    fn an_input_shows_what_was_measured_until_the_new_configuration_has_measured() {
        let (mut held, mut areas) = (Reconfigured::default(), [FishX1Transfer::default(); 2]);
        areas[0].set_ft_uni_config(Input::I3, InputMode::Resistance, false);
        let mut shown = |response, mode| shown_in(&mut held, &mut areas, response, mode);
        let (ohm, cm) = (Some(InputMode::Resistance), Some(InputMode::Ultrasonic));
        assert_eq!(shown((5, 1200), None), (ohm, 1200));
        assert_eq!(shown((6, 1201), cm), (ohm, 1201));
        assert_eq!(shown((7, 1202), None), (ohm, 1201), "an exchange that was under way");
        assert_eq!(shown((8, 40), None), (cm, 40));
        // There and back: what was measured before both.
        assert_eq!(shown((9, 41), ohm), (cm, 41));
        assert_eq!(shown((10, 1203), cm), (cm, 41));
        assert_eq!(shown((11, 1204), None), (cm, 41));
        assert_eq!(shown((12, 42), None), (cm, 42));
        // The same again: nothing else is measured, but the area has a 0.
        assert_eq!(shown((13, 43), cm), (cm, 43));
    }
}
