//! Lesson 2: the lamp at O8 blinks, half a second on and half a second off.

use std::time::Duration;

use ft_transfer_area::tx::Output::O8;

use crate::check::moment::{Lasted, Moment};
use crate::check::stage::Stage;
use crate::check::words::{german, Check, Wrong};

/// How long the program is watched.
const WATCHED: Duration = Duration::from_secs(6);
/// Half a second, as exactly as a busy computer makes it.
const LEAST: f64 = 0.3;
const MOST: f64 = 0.8;

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step("the lamp at O8 is lit", "die Lampe an O8 leuchtet");
    stage.soon(|now| now.is_on(O8), |_| {
        Wrong::new(
            "The lamp at O8 stays dark.",
            "Die Lampe an O8 bleibt dunkel.",
        )
        .hint(
            "what you write goes out when the guard is dropped: end its block before the program sleeps.",
            "Gesendet wird erst, wenn der Guard endet: Schließe seinen Block, bevor das Programm schläft.",
        )
    })?;
    stage.step(
        "it blinks for six seconds, half a second on and half a second off",
        "sie blinkt sechs Sekunden lang, eine halbe Sekunde an und eine halbe aus",
    );
    let (moments, _) = stage.watch(WATCHED, |_| false)?;
    judge(&spells(&moments))
}

/// How long the lamp was on or off at a time, without the last one, which has not ended.
fn spells(moments: &[Moment]) -> Vec<(bool, Lasted)> {
    let mut spells = Vec::new();
    let mut begin = moments[0];
    for now in moments {
        if now.is_on(O8) != begin.is_on(O8) {
            spells.push((begin.is_on(O8), now.since(&begin)));
            begin = *now;
        }
    }
    spells
}

fn judge(spells: &[(bool, Lasted)]) -> Check {
    if spells.is_empty() {
        return Err(Wrong::new(
            "The lamp at O8 is lit all the time.",
            "Die Lampe an O8 leuchtet die ganze Zeit.",
        )
        .hint(
            "switch it off, and sleep after that, too: otherwise it is on again at once.",
            "Schalte sie aus und warte auch danach, sonst ist sie sofort wieder an.",
        ));
    }
    let strange =
        spells.iter().find_map(|(is_on, lasted)| Some((*is_on, lasted.outside(LEAST, MOST)?)));
    if let Some((is_on, seconds)) = strange {
        let (en, de) = if is_on { ("on", "an") } else { ("off", "aus") };
        return Err(Wrong::new(
            format!("The lamp at O8 was {en} for {seconds:.2} s; it should be 0.5 s."),
            format!(
                "Die Lampe an O8 war {} s lang {de}, soll es aber 0,5 s lang sein.",
                german(seconds, 2)
            ),
        )
        .hint(
            "half a second is Duration::from_millis(500), once for on and once for off.",
            "Eine halbe Sekunde ist Duration::from_millis(500), einmal für an und einmal für aus.",
        ));
    }
    let whole: f64 = spells.iter().map(|(_, lasted)| lasted.least).sum();
    if whole < WATCHED.as_secs_f64() - 2.0 * MOST {
        return Err(Wrong::new(
            format!("The lamp at O8 blinked for {whole:.1} s, and then stopped."),
            format!("Die Lampe an O8 blinkte {} s lang und dann nicht mehr.", german(whole, 1)),
        )
        .hint("an endless loop is loop { … }.", "Eine Schleife ohne Ende ist loop { … }."));
    }
    Ok(())
}
