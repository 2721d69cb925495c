//! Lesson 10: a belt carries discs past a colour sensor. The white ones are blown into their storage, the others run
//! off the end.

use std::time::Duration;

use ft_transfer_area::tx::Motor::M1;
use ft_transfer_area::tx::Output::{O3, O4};
use ft_transfer_area_simulator::world::Piece;

use super::A_WHILE;
use crate::check::stage::Stage;
use crate::check::words::{Check, Wrong};

/// The names of the places in the world.
const ENTRY: &str = "entry";
const WHITE: &str = "white_storage";
const REST: &str = "rest";

/// How often to look where a disc is.
const LOOK: Duration = Duration::from_millis(100);
/// A disc needs about four seconds.
const LOOKS: u32 = 150;

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step("nothing is on the belt: it does not run", "nichts liegt auf dem Band: es steht");
    stage.stays(
        A_WHILE,
        |now| now.outputs_on().is_empty(),
        |now| {
            let on = now.outputs_on();
            Wrong::new(
                format!("Nothing is on the belt, but {on} is on."),
                format!("Nichts liegt auf dem Band, aber {on} ist an."),
            )
            .hint(
                "in the first state, in which the line waits for a disc, everything is off.",
                "Im ersten Zustand, in dem die Anlage auf eine Scheibe wartet, ist alles aus.",
            )
        },
    )?;
    for piece in [Piece::White, Piece::Red, Piece::White, Piece::Blue] {
        if piece == Piece::White {
            stage.step(
                "a white disc is blown into its storage",
                "eine weiße Scheibe wird in ihr Lager geblasen",
            );
        } else {
            stage.step("another disc runs off the end", "eine andere Scheibe läuft bis ans Ende");
        }
        sort(stage, piece)?;
    }
    Ok(())
}

/// Puts a disc on the belt and follows it to its storage.
fn sort(stage: &mut Stage, piece: Piece) -> Check {
    stage.change(|world| world.put(piece, ENTRY));
    stage.soon(|now| now.motor(M1) > 0, |now| not_started(now.motor(M1) < 0))?;
    let (own, other) = if piece == Piece::White { (WHITE, REST) } else { (REST, WHITE) };
    arrive(stage, piece, own, other)?;
    stage.soon(|now| now.motor(M1) == 0, |_| {
        Wrong::new(
            "The disc is in its storage, but the belt keeps running.",
            "Die Scheibe ist in ihrem Lager, aber das Band läuft weiter.",
        )
        .hint(
            "I6 and I7 report false when a disc has arrived. Then the line waits for the next one.",
            "I6 und I7 melden false, wenn eine Scheibe angekommen ist. Dann wartet die Anlage auf die nächste.",
        )
    })?;
    stage.soon(|now| !now.is_on(O3) && !now.is_on(O4), |_| {
        Wrong::new(
            "The disc is in its storage, but the valve O3 or the compressor O4 is still on.",
            "Die Scheibe ist in ihrem Lager, aber das Ventil O3 oder der Kompressor O4 ist noch an.",
        )
        .hint(
            "each state sets all outputs: belt, valve and compressor.",
            "Jeder Zustand setzt alle Ausgänge: Band, Ventil und Kompressor.",
        )
    })?;
    stage.change(|world| world.take(own));
    stage.pass(A_WHILE)
}

/// Waits until a disc is in its own storage.
fn arrive(stage: &mut Stage, piece: Piece, own: &str, other: &str) -> Check {
    for _ in 0..LOOKS {
        stage.pass(LOOK)?;
        let places = stage.look(|world| world.places()).unwrap_or_default();
        let has_disc = |name| places.iter().any(|(place, disc)| place == name && disc.is_some());
        if has_disc(own) {
            return Ok(());
        }
        if has_disc(other) {
            return Err(wrong_storage(piece));
        }
    }
    Err(Wrong::new(
        "The disc does not arrive: it lies on the belt, which is not running, or it was not blown off.",
        "Die Scheibe kommt nicht an: Sie liegt auf dem stehenden Band oder wurde nicht weggeblasen.",
    )
    .hint(
        "let the belt run until I6 or I7 reports the disc. A white one is at the valve 8 pulses of C1 behind I3, and the \
         valve O3 needs the compressor O4.",
        "Lass das Band laufen, bis I6 oder I7 die Scheibe meldet. Eine weiße ist 8 Impulse von C1 hinter I3 beim Ventil, \
         und das Ventil O3 braucht den Kompressor O4.",
    ))
}

fn not_started(backwards: bool) -> Wrong {
    if backwards {
        return Wrong::new(
            "A disc lies at the light barrier I1, and the belt runs backwards.",
            "Eine Scheibe liegt an der Lichtschranke I1, und das Band läuft rückwärts.",
        )
        .hint("M1 clockwise moves it forward.", "Mit M1 nach rechts läuft es vorwärts.");
    }
    Wrong::new(
        "A disc lies at the light barrier I1, but the belt does not start.",
        "Eine Scheibe liegt an der Lichtschranke I1, aber das Band läuft nicht an.",
    )
    .hint(
        "a light barrier reports true with light, and false when a disc is in it.",
        "Eine Lichtschranke meldet true, wenn Licht da ist, und false, wenn eine Scheibe darin liegt.",
    )
}

fn wrong_storage(piece: Piece) -> Wrong {
    if piece == Piece::White {
        return Wrong::new(
            "The white disc ran off the end instead of into its storage.",
            "Die weiße Scheibe lief bis ans Ende statt in ihr Lager.",
        )
        .hint(
            "the valve is 8 pulses of C1 behind I3; it must be open together with the compressor when the disc is \
             there. White is the lowest voltage while the disc passes I2: below 940 mV.",
            "Das Ventil liegt 8 Impulse von C1 hinter I3; es muss offen sein, wenn die Scheibe dort ist, und der \
             Kompressor an. Weiß ist die kleinste Spannung, während die Scheibe an I2 vorbeiläuft: unter 940 mV.",
        );
    }
    Wrong::new(
        "A disc that is not white was blown into the storage of the white ones.",
        "Eine Scheibe, die nicht weiß ist, wurde in das Lager der weißen geblasen.",
    )
    .hint(
        "take the lowest voltage of this disc only: begin with a high value for each disc. White is below 940 mV, red \
         about 1320 mV, blue about 1540 mV.",
        "Nimm die kleinste Spannung nur dieser Scheibe: Beginne bei jeder Scheibe mit einem hohen Wert. Weiß liegt \
         unter 940 mV, Rot bei 1320 mV, Blau bei 1540 mV.",
    )
}
