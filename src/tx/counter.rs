//! Counters.

use super::{next_id, Counter};
use crate::transfer_area::FishX1Transfer;

impl FishX1Transfer {
    /// Resets a counter to 0, which takes two exchanges.
    ///
    /// Raises the [`cnt_reset_cmd_id`](crate::transfer_area::OutputValues::cnt_reset_cmd_id) by one, and
    /// after 65535 to 0; if that is the id last reported as done, by one more. When the reset is done,
    /// [`is_cnt_reset_ready`](Self::is_cnt_reset_ready) is `true` and
    /// [`cnt_resetted`](crate::transfer_area::InputValues::cnt_resetted) becomes 1; this call sets them
    /// to `false` and 0.
    #[doc(alias = "StartCounterReset")]
    pub fn start_counter_reset(&mut self, counter: Counter) {
        let index = counter.index();
        self.output.cnt_reset_cmd_id[index] =
            next_id(self.output.cnt_reset_cmd_id[index], self.input.cnt_reset_cmd_id[index]);
        self.input.cnt_resetted[index] = 0;
    }

    /// Whether the last reset of a counter is done. Also `true` when there was none.
    #[doc(alias = "IsCntResetReady")]
    #[must_use]
    pub fn is_cnt_reset_ready(&self, counter: Counter) -> bool {
        let index = counter.index();
        self.input.cnt_reset_cmd_id[index] == self.output.cnt_reset_cmd_id[index]
    }

    /// The pulses of a counter since its last reset, and the current level of its input.
    #[doc(alias = "GetInCounterValue")]
    #[must_use]
    pub fn get_in_counter_value(&self, counter: Counter) -> (u16, bool) {
        (self.get_in_cnt_count(counter), self.get_in_cnt_state(counter))
    }

    /// The pulses of a counter since its last reset, 0..=65535. The area holds them as a signed number,
    /// which is negative above 32767.
    #[doc(alias = "GetInCntCount")]
    #[must_use]
    pub fn get_in_cnt_count(&self, counter: Counter) -> u16 {
        self.input.counter[counter.index()] as u16
    }

    /// The current level of a counter input.
    #[doc(alias = "GetInCntState")]
    #[must_use]
    pub fn get_in_cnt_state(&self, counter: Counter) -> bool {
        self.input.cnt_in[counter.index()] != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_is_done_when_its_own_id_comes_back() {
        let mut area = FishX1Transfer::default();
        assert!(area.is_cnt_reset_ready(Counter::C2));
        area.input.cnt_resetted[1] = 1;
        // A controller that remembers an earlier program's reset.
        area.input.cnt_reset_cmd_id[1] = 1;
        area.start_counter_reset(Counter::C2);
        assert_eq!(area.output.cnt_reset_cmd_id, [0, 2, 0, 0]);
        assert_eq!((area.input.cnt_resetted[1], area.is_cnt_reset_ready(Counter::C2)), (0, false));
        area.input.cnt_reset_cmd_id[1] = 2;
        assert!(area.is_cnt_reset_ready(Counter::C2));
    }

    #[test]
    fn counts_are_not_signed() {
        let mut area = FishX1Transfer::default();
        *area.input.counter = [0, 1, i16::MAX, -1];
        *area.input.cnt_in = [0, 1, 0, 1];
        let values = Counter::ALL.map(|counter| area.get_in_counter_value(counter));
        assert_eq!(values, [(0, false), (1, true), (32_767, false), (65_535, true)]);
    }
}
