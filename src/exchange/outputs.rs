//! The outputs of an area, as they are sent.

use std::mem;

use super::Sends;
use crate::notices::notice;
use crate::terminals::Output;
use crate::transfer_area::{DUTY_MAX, IZ_PWM_CHAN, MAX_AREAS};
use crate::wire::ExchangeData;

/// Brings duties into their range, and warns of those out of range.
#[derive(Clone, Debug, Default)]
pub(super) struct Outputs {
    /// For each area and output, whether its duty was out of range in the last request, so that only
    /// the first of several such requests is logged.
    out_of_range: [[bool; IZ_PWM_CHAN]; MAX_AREAS],
    /// Of which controller it warns, if that is known: a program may have several.
    pub(super) peer: Option<String>,
}

impl Outputs {
    /// The output part of the area with this index (0 the master).
    pub(super) fn of(&mut self, index: usize, area: &impl Sends) -> ExchangeData {
        let (output, sound) = (area.output(), area.txt_outputs());
        let duty = output.sent_duty();
        // Nearly always all duties are in range, and were before.
        if duty != output.duty || self.out_of_range[index] != [false; IZ_PWM_CHAN] {
            self.warn(index, &output.duty, &duty);
        }
        ExchangeData {
            duty: *duty,
            master: output.master.map(i16::from),
            distance: *output.distance,
            motor_command_id: *output.motor_ex_cmd_id,
            counter_reset_id: *output.cnt_reset_cmd_id,
            sound_command_id: sound.sound_cmd_id,
            sound_index: sound.sound_index,
            sound_repeat: sound.sound_repeat,
        }
    }

    /// Remembers which duties are out of range, and warns of those that were not before.
    #[cold]
    fn warn(&mut self, index: usize, duties: &[i16; IZ_PWM_CHAN], sent: &[i16; IZ_PWM_CHAN]) {
        let peer = self.peer.as_ref().map(|peer| format!("{peer}: ")).unwrap_or_default();
        for output in Output::ALL {
            let (duty, sent) = (duties[output.index()], sent[output.index()]);
            let is_out = sent != duty;
            let was_out = mem::replace(&mut self.out_of_range[index][output.index()], is_out);
            if is_out && !was_out {
                notice!(
                    Warn,
                    "{peer}{output} in area {index} has duty {duty}, which is not 0..={DUTY_MAX}: {sent} is sent"
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use parking_lot::Mutex;

    use super::*;
    use crate::notices;
    use crate::transfer_area::FishX1Transfer;

    /// Collects the warnings of all tests.
    struct Warnings;

    static WARNINGS: Mutex<Vec<String>> = Mutex::new(Vec::new());

    impl log::Log for Warnings {
        fn enabled(&self, _: &log::Metadata<'_>) -> bool {
            true
        }

        fn log(&self, record: &log::Record<'_>) {
            WARNINGS.lock().push(record.args().to_string());
        }

        fn flush(&self) {}
    }

    /// The new warnings of a test that alone uses these duties.
    fn warnings(duties: &[i16]) -> Vec<String> {
        notices::flush(Duration::from_secs(30));
        let of_test =
            |text: &String| duties.iter().any(|duty| text.contains(&format!("has duty {duty},")));
        std::mem::take(&mut *WARNINGS.lock()).into_iter().filter(of_test).collect()
    }

    #[test]
    fn a_duty_out_of_range_is_sent_as_the_nearest_in_range() {
        let mut area = FishX1Transfer::default();
        for (given, sent) in
            [(i16::MIN, 0), (-1, 0), (0, 0), (1, 1), (512, 512), (513, 512), (i16::MAX, 512)]
        {
            *area.output.duty = [given; 8];
            for index in 0..MAX_AREAS {
                assert_eq!(Outputs::default().of(index, &area).duty, [sent; 8]);
            }
            assert_eq!(area.output.duty, [given; 8]);
        }
    }

    #[test]
    fn a_duty_out_of_range_is_logged_once_until_it_is_back_in_range() {
        log::set_logger(&Warnings).unwrap();
        log::set_max_level(log::LevelFilter::Warn);
        let mut outputs = Outputs::default();
        let mut area = FishX1Transfer::default();
        let mut send = |index, duty| {
            area.output.duty[2] = duty;
            outputs.of(index, &area);
            warnings(&[30_001, -777])
        };
        let first = "O3 in area 0 has duty 30001, which is not 0..=512: 512 is sent";
        assert_eq!(send(0, 30_001), [first]);
        assert!((0..100).all(|_| send(0, 30_001).is_empty()));
        // Another area has outputs of its own.
        assert_eq!(send(8, -777), ["O3 in area 8 has duty -777, which is not 0..=512: 0 is sent"]);
        assert!(send(0, -777).is_empty(), "it was not in range between");
        assert!(send(0, 512).is_empty());
        assert_eq!(send(0, 30_001), [first]);
        let mut of_other = Outputs { peer: Some("10.0.0.8:65000".into()), ..Outputs::default() };
        of_other.of(0, &area);
        assert_eq!(warnings(&[30_001]), [format!("10.0.0.8:65000: {first}")]);
    }
}
