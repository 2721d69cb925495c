//! What a program says on its standard error: it is passed on, and its end is kept, because it may say what is wrong.

use std::io::{self, Read, Write};
use std::process::ChildStderr;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::words::Words;

/// How much of it is kept, in bytes.
const KEPT: usize = 16 << 10;
/// How long the last words of a program that has ended are waited for. What it has started may still have the pipe.
const LAST_WORDS: Duration = Duration::from_millis(500);
const LOOK: Duration = Duration::from_millis(5);

/// What is heard of one program.
pub(super) struct Heard {
    kept: Arc<Mutex<Vec<u8>>>,
    listener: JoinHandle<()>,
}

impl Heard {
    /// Listens until the program closes this pipe.
    pub(super) fn listen(mut from: ChildStderr) -> io::Result<Self> {
        let kept = Arc::new(Mutex::new(Vec::new()));
        let keeps = Arc::clone(&kept);
        let listen = move || {
            let mut part = [0; 4096];
            while let Ok(length @ 1..) = from.read(&mut part) {
                // A terminal that has been closed is no reason to stop.
                let _ = io::stderr().write_all(&part[..length]);
                keep(&mut keeps.lock().unwrap_or_else(PoisonError::into_inner), &part[..length]);
            }
        };
        let listener = thread::Builder::new().name(String::from("heard")).spawn(listen)?;
        Ok(Self { kept, listener })
    }

    /// Waits for the last words of a program that has ended.
    pub(super) fn wait(&self) {
        let deadline = Instant::now() + LAST_WORDS;
        while !self.listener.is_finished() && Instant::now() < deadline {
            thread::sleep(LOOK);
        }
    }

    /// What the last error that is known here means, and what may help.
    /// One that was online has connected to the right address.
    pub(super) fn advice(&self, was_online: bool) -> Option<Words> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        advice(&String::from_utf8_lossy(&kept), was_online)
    }

    /// Whether the library has warned that a guard is held for long.
    pub(super) fn warned_of_guard(&self) -> bool {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        String::from_utf8_lossy(&kept).contains("has held a guard of the transfer areas")
    }
}

/// Adds a part, and forgets the oldest bytes when there is no room.
fn keep(kept: &mut Vec<u8>, part: &[u8]) {
    kept.extend_from_slice(part);
    let surplus = kept.len().saturating_sub(KEPT);
    kept.drain(..surplus);
}

/// What the library's warning of a guard means.
pub(super) const GUARD: Words = Words::fixed(
    "the program holds a guard for too long, and the library warns of it above: while it is held, its inputs do not \
     change, and what was written is not sent. Call wait_cycle inside the loop, so that each round has a new guard.",
    "Das Programm hält einen Guard zu lange fest, davor warnt die Bibliothek oben: Solange ändern sich seine \
     Eingänge nicht, und nichts wird gesendet. Rufe wait_cycle in der Schleife auf, dann hat jede Runde einen neuen \
     Guard.",
);

/// Those of the address to which a program connects.
const OF_ADDRESS: [&str; 2] = ["gaierror", "ConnectionRefusedError"];

/// Parts of messages, and what they mean: `@` is the terminal that a message names right before its part. The one that was
/// said last counts: a program may go on after an error.
const MEANINGS: &[(&str, Words)] = &[
    (
        "which is configured as a motor",
        Words::fixed(
            "this output is still half of a motor. Before begin_transfer: areas.lock()[LOCAL_IO].set_ft_motor_config(@, \
             false).",
            "Dieser Ausgang ist noch ein halber Motor. Vor begin_transfer: \
             areas.lock()[LOCAL_IO].set_ft_motor_config(@, false).",
        ),
    ),
    (
        "is configured as the single outputs",
        Words::fixed(
            "this motor was made two single outputs by set_ft_motor_config(…, false). Leave that out, or use \
             set_out_pwm_values.",
            "Aus diesem Motor wurden mit set_ft_motor_config(…, false) zwei einzelne Ausgänge. Lass das weg, oder nimm \
             set_out_pwm_values.",
        ),
    ),
    (
        "is configured to report its measured value",
        Words::fixed(
            "this input measures. Read it with get_in_io_value_analogue, or make it digital by set_ft_uni_config(…, \
             true).",
            "Dieser Eingang misst. Lies ihn mit get_in_io_value_analogue, oder mach ihn mit set_ft_uni_config(…, true) \
             digital.",
        ),
    ),
    (
        "is configured as digital",
        Words::fixed(
            "this input is one for buttons. Before begin_transfer: areas.lock()[LOCAL_IO].set_ft_uni_config(@, \
             InputMode::Resistance, false), with the mode that its sensor needs.",
            "Dieser Eingang ist für Taster eingestellt. Vor begin_transfer: \
             areas.lock()[LOCAL_IO].set_ft_uni_config(@, InputMode::Resistance, false), mit der Betriebsart für \
             seinen Sensor.",
        ),
    ),
    (
        "but has to be",
        Words::fixed(
            "the message names the number that is too small or too large, and what it may be.",
            "Eine Zahl ist zu klein oder zu groß; die Meldung nennt sie und was erlaubt ist. DUTY_MAX ist 512.",
        ),
    ),
    (
        "did not happen within",
        Words::fixed(
            "what the program waited for did not happen in time. Is it the right terminal? Duration::MAX waits without \
             a limit.",
            "Worauf das Programm wartete, das geschah nicht rechtzeitig. Stimmt der Anschluss? Duration::MAX wartet \
             ohne Grenze.",
        ),
    ),
    (
        "the watchdog has set all outputs to",
        Words::fixed(
            "the loop hung for longer than the watchdog allows, so all outputs were switched off. Does it sleep, or \
             hold a guard?",
            "Die Schleife hing länger, als der Watchdog erlaubt, deshalb ging alles aus. Schläft sie, oder hält sie \
             einen Guard fest?",
        ),
    ),
    (
        "has had the transfer areas locked",
        Words::fixed(
            "the program asks for the areas while it has them. A guard in a variable ends with its block { … }: let it \
             end before wait_until, wait_cycle or lock.",
            "Das Programm verlangt die Werte, während es sie schon hat. Ein Guard in einer Variablen endet mit seinem \
             Block { … }: Lass ihn enden, bevor wait_until, wait_cycle oder lock kommt.",
        ),
    ),
    (
        "a distance is 1 to",
        Words::fixed(
            "the distance is the last number of start_motor_ex_cmd, and 0 is none.",
            "Die Strecke ist die letzte Zahl von start_motor_ex_cmd, und 0 ist keine.",
        ),
    ),
    (
        "is named twice in one motor command",
        Words::fixed(
            "the list has only the motors that follow, not the first one.",
            "In der Liste stehen nur die Motoren, die folgen, nicht auch der erste.",
        ),
    ),
    (
        "call begin_transfer",
        Words::fixed(
            "handler.begin_transfer()? comes before the first value is read.",
            "handler.begin_transfer()? kommt, bevor der erste Wert gelesen wird.",
        ),
    ),
    (
        "gaierror",
        Words::fixed(
            "the address has a port after a colon, which ftrobopy takes apart from it: host, port = \
             sys.argv[-1].split(\":\"), then ftrobopy.ftrobopy(host, int(port)).",
            "In der Adresse steht nach einem Doppelpunkt der Port. ftrobopy will beides getrennt: host, port = \
             sys.argv[-1].split(\":\"), dann ftrobopy.ftrobopy(host, int(port)).",
        ),
    ),
    (
        "ConnectionRefusedError",
        Words::fixed(
            "the program connects to another address or port than it was given: host, port = \
             sys.argv[-1].split(\":\"), then ftrobopy.ftrobopy(host, int(port)).",
            "Das Programm verbindet sich mit einer anderen Adresse oder einem anderen Port als angegeben: host, port = \
             sys.argv[-1].split(\":\"), dann ftrobopy.ftrobopy(host, int(port)).",
        ),
    ),
    (
        "ModuleNotFoundError",
        Words::fixed(
            "a package that the program imports is not installed for this Python: python3 -m pip install, and its name.",
            "Ein Paket, das das Programm importiert, ist für dieses Python nicht installiert: python3 -m pip install, und \
             sein Name.",
        ),
    ),
    (
        "not yet implemented",
        Words::fixed(
            "todo!() ends the program. Write in its place what is to be done in this case.",
            "todo!() bricht das Programm ab. Schreib an seine Stelle, was in diesem Fall geschehen soll.",
        ),
    ),
    (
        "panicked at",
        Words::fixed(
            "the message names the line of your program at which it panicked.",
            "Die Meldung nennt die Zeile deines Programms, in der es abgebrochen ist (panicked).",
        ),
    ),
];

fn advice(text: &str, was_online: bool) -> Option<Words> {
    // A message for a person may be broken into lines.
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let is_meant = |part: &&str| !(was_online && OF_ADDRESS.contains(part));
    let said = MEANINGS.iter().filter(|(part, _)| is_meant(part));
    let said = said.filter_map(|(part, words)| Some((text.rfind(part)?, words)));
    let (place, words) = said.max_by_key(|(place, _)| *place)?;
    let terminal =
        text[..place].trim_end_matches([' ', ',']).rsplit(' ').next().unwrap_or_default();
    Some(words.replace("@", terminal))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use ft_transfer_area::tx::{Input, InvalidCall, Motor, Output};
    use ft_transfer_area::Error;

    use super::super::words::Language;
    use super::*;

    #[test]
    fn a_package_that_is_missing_is_no_wrong_address() {
        let said =
            "Traceback (most recent call last):\nModuleNotFoundError: No module named 'ftrobopy'";
        let words = advice(said, false).unwrap();
        assert!(words.text(Language::En).contains("pip install"));
    }

    #[test]
    fn what_the_library_says_has_a_meaning_in_german() {
        for (error, part) in [
            (Error::from(InvalidCall::NotAnOutput { output: Output::O8 }), "halber Motor"),
            (InvalidCall::NotAMotor { motor: Motor::M1 }.into(), "einzelne Ausgänge"),
            (InvalidCall::ZeroPulses.into(), "Strecke"),
            (InvalidCall::MotorTwice { motor: Motor::M1 }.into(), "Liste"),
            (Error::OutOfRange { what: "duty", given: 513, least: -512, most: 512 }, "zu groß"),
            (Error::WaitTimedOut { limit: Duration::from_secs(1) }, "rechtzeitig"),
            (Error::WatchdogExpired { limit: Duration::from_secs(2) }, "Watchdog"),
            (Error::NotStarted, "begin_transfer"),
        ] {
            let meaning = advice(&format!("Error: {error:?}\n"), true).unwrap();
            assert!(meaning.text(Language::De).contains(part), "{error}: {meaning:?}");
        }
        assert!(advice("Error: out of coffee", false).is_none());
        let todo = "thread 'main' panicked at src/main.rs:9:5:\nnot yet implemented\n";
        assert!(advice(todo, true).unwrap().text(Language::De).contains("todo!()"));
    }

    #[test]
    fn a_hint_names_the_terminal_of_the_message() {
        let half = Error::from(InvalidCall::NotAnOutput { output: Output::O3 });
        let digital = Error::from(InvalidCall::NotAnalog { input: Input::I2 });
        for (error, code) in
            [(half, "set_ft_motor_config(M2, false)"), (digital, "set_ft_uni_config(I2, ")]
        {
            for said in [format!("Error: {error:?}\n"), format!("{error}")] {
                let meaning = advice(&said, false).unwrap();
                assert!(meaning.text(Language::En).contains(code), "{said}: {meaning:?}");
                assert!(meaning.text(Language::De).contains(code), "{said}: {meaning:?}");
            }
        }
    }

    #[test]
    fn what_was_said_last_counts() {
        let waited = Error::WaitTimedOut { limit: Duration::from_secs(1) };
        let said = format!(
            "goes on after: {waited}\nthread 'main' panicked at src/main.rs:9:5:\nno more coffee\n"
        );
        let meaning = advice(&said, false).unwrap();
        assert!(meaning.text(Language::En).contains("at which it panicked"), "{meaning:?}");
        let said = format!("thread 'main' panicked at src/main.rs:9:5:\ncalled unwrap: {waited}\n");
        let meaning = advice(&said, false).unwrap();
        assert!(meaning.text(Language::En).contains("did not happen in time"), "{meaning:?}");
    }

    #[test]
    fn only_the_end_is_kept() {
        let mut kept = Vec::new();
        (0..10_000).for_each(|number: u16| keep(&mut kept, &number.to_le_bytes()));
        assert_eq!(kept.len(), KEPT);
        assert_eq!(kept[KEPT - 2..], 9_999_u16.to_le_bytes());
    }
}
