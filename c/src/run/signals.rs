//! Signals to this process, which compilers and the program get too.

use std::io::{self, Read};
use std::process::{self, Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{sync_channel, RecvTimeoutError, SyncSender};
use std::thread;
use std::time::{Duration, Instant};

use crate::{read, Sentence};

#[cfg(unix)]
use unix::came;
#[cfg(not(unix))]
use windows::came;

#[cfg(unix)]
pub(crate) use unix::{
    is_crash, is_to_pause, let_suspend_it, name_in, pass_on_to, pass_on_to_group, pause,
    stop_passing_on, take_up, take_up_pauses, words_of,
};
#[cfg(not(unix))]
pub(crate) use windows::{
    is_crash, is_to_pause, let_suspend_it, name_in, pass_on_to, pass_on_to_group, pause,
    stop_passing_on, take_up, take_up_pauses, words_of,
};

/// An error when a signal has come while this was done: then what a child says is not about the program.
pub(crate) fn check(what_was_done: &str) -> Result<(), Sentence> {
    match came() {
        Some(signal) => Err(format!("ended by {signal} while {what_was_done}").into()),
        None => Ok(()),
    }
}

/// How many threads are writing to the error output, which may be a pipe that nobody reads.
static WRITING: AtomicUsize = AtomicUsize::new(0);

/// Whether the program has begun. Before that nothing can move.
static HAS_PROGRAM: AtomicBool = AtomicBool::new(false);

/// Whether a second signal has come when the program had ended.
static GIVES_UP: AtomicBool = AtomicBool::new(false);

/// Whether nothing is to be tried any more.
pub(crate) fn gives_up() -> bool {
    GIVES_UP.load(Ordering::SeqCst)
}

/// From now on a second signal does not end this process, which has to stop what the program leaves.
pub(crate) fn begin_program() {
    HAS_PROGRAM.store(true, Ordering::SeqCst);
}

/// Runs what writes to the error output: from a second after a signal on, this process does not wait for it.
pub(crate) fn while_writing<R>(write: impl FnOnce() -> R) -> R {
    WRITING.fetch_add(1, Ordering::SeqCst);
    let result = write();
    WRITING.fetch_sub(1, Ordering::SeqCst);
    result
}

/// After the first signal: ends this process when only words are left, and nobody reads them.
fn end_unread_words() {
    const LOOK: Duration = Duration::from_millis(20);
    const LIMIT: u32 = 50;
    let mut looks = 0;
    while looks < LIMIT {
        thread::sleep(LOOK);
        looks = if WRITING.load(Ordering::SeqCst) > 0 { looks + 1 } else { 0 };
    }
    end_now();
}

/// Ends this process at once.
fn end_now() -> ! {
    #[cfg(unix)]
    crate::terminal::put_back();
    process::exit(1)
}

/// Runs a compiler, and returns what it has said. A script starts others, which get signals, too.
pub(crate) fn output_of(command: &mut Command) -> Result<Output, Sentence> {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut run = || -> io::Result<Output> {
        let mut child = command.spawn()?;
        let id = pass_on_to_group(&child);
        let texts = read_texts(&mut child);
        if texts.is_err() {
            // What it has started ends when nobody reads any more.
            let _ = child.kill();
        }
        let status = child.wait();
        stop_passing_on(id);
        let [stdout, stderr] = texts?;
        Ok(Output { status: status?, stdout, stderr })
    };
    let output = run();
    let name = command.get_program().to_string_lossy();
    output.map_err(|error| match error.kind() {
        io::ErrorKind::FileTooLarge => format!("the output of {name} has more than 100 MB").into(),
        _ => format!("the compiler {name} can't be started: {error}").into(),
    })
}

/// Reads what a compiler writes to both outputs, until it has ended: what it has started may go on with them.
fn read_texts(child: &mut Child) -> io::Result<[Vec<u8>; 2]> {
    const LOOK: Duration = Duration::from_millis(20);
    const LAST_WORDS: Duration = Duration::from_secs(1);
    let (sender, parts) = sync_channel(16);
    let out = child.stdout.take().map(|it| Box::new(it) as Box<dyn Read + Send>);
    let errors = child.stderr.take().map(|it| Box::new(it) as Box<dyn Read + Send>);
    for (which, output) in [out, errors].into_iter().flatten().enumerate() {
        let sender = sender.clone();
        thread::Builder::new().spawn(move || read_parts(output, which, &sender))?;
    }
    drop(sender);
    let mut texts = [Vec::new(), Vec::new()];
    let (mut looked, mut ended) = (Instant::now(), None);
    while ended.is_none_or(|ended: Instant| ended.elapsed() < LAST_WORDS) {
        match parts.recv_timeout(LOOK) {
            Ok((which, part)) => texts[which].extend_from_slice(&part?),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if texts.iter().any(|text| text.len() > read::MOST) {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        if ended.is_none() && looked.elapsed() >= LOOK {
            looked = Instant::now();
            ended = child.try_wait()?.map(|_| looked);
        }
    }
    Ok(texts)
}

/// Reads one of the outputs until its end, or until nobody wants more.
fn read_parts(
    mut output: impl Read,
    which: usize,
    parts: &SyncSender<(usize, io::Result<Vec<u8>>)>,
) {
    let mut bytes = vec![0; 64 << 10];
    loop {
        let read = match output.read(&mut bytes) {
            Ok(0) => return,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            read => read.map(|size| bytes[..size].to_vec()),
        };
        let is_over = read.is_err();
        if parts.send((which, read)).is_err() || is_over {
            return;
        }
    }
}

/// What a program on Windows has crashed with, or was ended by. There it is the exit status: an NTSTATUS.
#[cfg(any(not(unix), test))]
fn name_of_status(code: i32) -> Option<&'static str> {
    Some(match code as u32 {
        0xC000_0005 => "an access violation (memory that is not the program's)",
        0xC000_0006 => "a page error (memory that could not be read)",
        0xC000_001D => "an instruction that the processor does not know",
        0xC000_008E | 0xC000_0094 => "a division by zero",
        0xC000_0095 => "an overflow in a division",
        0xC000_00FD => "a stack overflow (no room left on the stack)",
        0xC000_0135 => "Windows (a DLL is missing)",
        0xC000_0139 => "Windows (a DLL lacks a function)",
        0xC000_013A => "Ctrl-C",
        0xC000_0374 => "Windows (the heap was corrupted)",
        0xC000_0409 => "abort (or a corrupted stack)",
        _ => return None,
    })
}

#[cfg(unix)]
mod unix {
    use std::os::unix::process::{CommandExt, ExitStatusExt};
    use std::process::{Child, Command, ExitStatus};
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    use std::sync::{Arc, LazyLock, Mutex, MutexGuard};
    use std::time::{Duration, Instant};
    use std::{io, thread};

    use signal_hook::consts::{
        SIGHUP, SIGINT, SIGKILL, SIGQUIT, SIGTERM, SIGTSTP, SIGTTIN, SIGTTOU,
    };
    use signal_hook::flag;
    use signal_hook::iterator::exfiltrator::raw::WithRawSiginfo;
    use signal_hook::iterator::SignalsInfo;
    use signal_hook::low_level::signal_name;

    /// The signals that ask for the end.
    const ENDS: [i32; 4] = [SIGINT, SIGTERM, SIGHUP, SIGQUIT];

    /// The signals by which a terminal suspends a program, and this process with it.
    const PAUSES: [i32; 3] = [SIGTSTP, SIGTTIN, SIGTTOU];

    /// How long after the first signal another one is a second one.
    const SECOND_AFTER: Duration = Duration::from_secs(1);

    /// The children that run; the negative ones are groups of them.
    static CHILDREN: Mutex<Vec<libc::pid_t>> = Mutex::new(Vec::new());
    /// The last signal; 0 for none. It is known at once, before a child that got it has ended.
    static LAST: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

    /// Whether who has started this process holds SIGTTOU back.
    static WAS_HELD: AtomicBool = AtomicBool::new(false);

    /// Whether one of those has come that suspend.
    static PAUSE: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

    fn children() -> MutexGuard<'static, Vec<libc::pid_t>> {
        CHILDREN.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// From now on signals do not end this process. A closed terminal that it was started to ignore, as by `nohup`, the
    /// program ignores, too. Other signals that who has started it ignores or holds back are let through, also to the
    /// program: in a script, what ends with `&` ignores Ctrl-C, and its motors would go on.
    pub(crate) fn take_up() -> io::Result<()> {
        // Where who started this process ignores the ends of children, nobody could wait for them.
        // SAFETY: no handler is set.
        unsafe { libc::signal(libc::SIGCHLD, libc::SIG_DFL) };
        let stays = |signal: i32| signal == SIGHUP && is_ignored(signal);
        let ends: Vec<_> = ENDS.into_iter().filter(|signal| !stays(*signal)).collect();
        for signal in &ends {
            flag::register_usize(*signal, Arc::clone(&LAST), *signal as usize)?;
        }
        let signals = SignalsInfo::<WithRawSiginfo>::new(ends)?;
        let_through();
        write_from_behind();
        let pass_on = move || {
            let_suspend();
            pass_on(signals);
        };
        thread::Builder::new().name("signals".into()).spawn(pass_on)?;
        Ok(())
    }

    /// In this thread, from which all others and children take it over.
    fn let_through() {
        let ends = set_of(&ENDS);
        // SAFETY: the set is this function's.
        unsafe { libc::pthread_sigmask(libc::SIG_UNBLOCK, &raw const ends, std::ptr::null_mut()) };
    }

    fn set_of(signals: &[i32]) -> libc::sigset_t {
        // SAFETY: a set, for which all bits 0 are valid.
        let mut set: libc::sigset_t = unsafe { std::mem::zeroed() };
        // SAFETY: the set is this function's, and the signals are there.
        unsafe {
            libc::sigemptyset(&raw mut set);
            signals.iter().for_each(|signal| _ = libc::sigaddset(&raw mut set, *signal));
        }
        set
    }

    /// What this process writes to a terminal does not suspend it, also where that suspends who writes from the background
    /// (`stty tostop`): it may have to stop a motor. In this thread, from which others take it over.
    fn write_from_behind() {
        let (held, mut before) = (set_of(&[SIGTTOU]), set_of(&[]));
        // SAFETY: the sets are this function's.
        let is_held = unsafe {
            libc::pthread_sigmask(libc::SIG_BLOCK, &raw const held, &raw mut before);
            libc::sigismember(&raw const before, SIGTTOU) == 1
        };
        WAS_HELD.store(is_held, Ordering::SeqCst);
    }

    /// In a thread that writes nothing, or in a child.
    fn let_suspend() {
        let held = set_of(&[SIGTTOU]);
        // SAFETY: the set is this function's.
        unsafe { libc::pthread_sigmask(libc::SIG_UNBLOCK, &raw const held, std::ptr::null_mut()) };
    }

    /// Has the program suspended by what suspends one that is started by hand.
    pub(crate) fn let_suspend_it(command: &mut Command) {
        if !WAS_HELD.load(Ordering::SeqCst) {
            // SAFETY: between fork and exec it makes a system call.
            unsafe {
                command.pre_exec(|| {
                    let_suspend();
                    Ok(())
                })
            };
        }
    }

    /// From now on what suspends the program does not suspend this process, which has to stop what it leaves.
    pub(crate) fn take_up_pauses() -> io::Result<()> {
        for signal in PAUSES.into_iter().filter(|signal| !is_ignored(*signal)) {
            flag::register(signal, Arc::clone(&PAUSE))?;
        }
        Ok(())
    }

    /// Whether the program was suspended by its terminal, which waits for this process, too.
    pub(crate) fn is_to_pause(program: &Child) -> bool {
        if !PAUSE.load(Ordering::SeqCst) {
            return false;
        }
        // SAFETY: integers and pointers, for which all bits 0 are valid.
        let mut found: libc::siginfo_t = unsafe { std::mem::zeroed() };
        // Only asks.
        let how = libc::WSTOPPED | libc::WNOHANG | libc::WNOWAIT;
        // SAFETY: the place is this function's.
        let asked = unsafe { libc::waitid(libc::P_PID, program.id(), &raw mut found, how) };
        asked == 0 && found.si_signo == libc::SIGCHLD
    }

    /// Suspends this process until the shell continues it with its program. Where no shell could do so, as behind
    /// `ssh -t`, the signal does nothing: SIGSTOP would suspend for ever.
    pub(crate) fn pause() {
        // SAFETY: integers, pointers and sets, for which all bits 0 are valid.
        let [mut usual, mut own]: [libc::sigaction; 2] = unsafe { std::mem::zeroed() };
        usual.sa_sigaction = libc::SIG_DFL;
        // SAFETY: the actions are this function's.
        unsafe {
            if libc::sigaction(SIGTSTP, &raw const usual, &raw mut own) == 0 {
                libc::raise(SIGTSTP);
                libc::sigaction(SIGTSTP, &raw const own, std::ptr::null_mut());
            }
        }
        PAUSE.store(false, Ordering::SeqCst);
    }

    /// Passes signals on to the children. One that comes a second after the first ends at once what has not ended: a
    /// program that is killed is followed by a last exchange. A terminal may send the same one twice.
    fn pass_on(mut signals: SignalsInfo<WithRawSiginfo>) {
        let mut first = None;
        for came in signals.forever() {
            let since = first.get_or_insert_with(|| {
                // Without this thread, somebody has to read the words.
                let _ = thread::Builder::new().spawn(super::end_unread_words);
                Instant::now()
            });
            let is_second = since.elapsed() >= SECOND_AFTER;
            let signal = if is_second { SIGKILL } else { came.si_signo };
            let children = children();
            if is_second && children.is_empty() {
                super::GIVES_UP.store(true, Ordering::SeqCst);
            }
            for process in children.iter() {
                let has_it = !is_second && got_it_too(&came, *process);
                // One that is suspended goes on, to end.
                send(*process, if has_it { libc::SIGCONT } else { signal });
            }
            drop(children);
            let has_program = super::HAS_PROGRAM.load(Ordering::SeqCst);
            if is_second && (!has_program || super::WRITING.load(Ordering::SeqCst) > 0) {
                super::end_now();
            }
        }
    }

    fn is_ignored(signal: i32) -> bool {
        // SAFETY: integers, pointers and sets, for which all bits 0 are valid.
        let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
        // SAFETY: the place for the action is this function's.
        let known = unsafe { libc::sigaction(signal, std::ptr::null(), &raw mut action) } == 0;
        known && action.sa_sigaction == libc::SIG_IGN
    }

    /// Whether a child got this signal itself: a terminal sends it to all of the group in front. Only that it was closed
    /// it tells the first process of its session alone, which the shell is, or this one, as behind `ssh -t`.
    fn got_it_too(came: &libc::siginfo_t, process: libc::pid_t) -> bool {
        /// `SI_KERNEL`
        const FROM_TERMINAL: i32 = 0x80;
        let is_of_terminal = cfg!(target_os = "linux") && came.si_code == FROM_TERMINAL;
        // SAFETY: calls without pointers.
        let (is_first, is_in_group) = unsafe {
            (libc::getsid(0) == libc::getpid(), libc::getpgid(process) == libc::getpgrp())
        };
        let is_for_all = came.si_signo != SIGHUP || !is_first;
        is_of_terminal && is_for_all && process > 0 && is_in_group
    }

    /// Also to one that is suspended.
    fn send(process: libc::pid_t, signal: i32) {
        // SAFETY: calls without pointers. The process is a child that was not waited for yet, or has only
        // just ended.
        unsafe {
            libc::kill(process, signal);
            libc::kill(process, libc::SIGCONT);
        }
    }

    /// The name of the last signal that has come.
    pub(crate) fn came() -> Option<&'static str> {
        match LAST.load(Ordering::SeqCst) as i32 {
            0 => None,
            SIGINT => Some("Ctrl-C"),
            signal => Some(signal_name(signal).unwrap_or("a signal")),
        }
    }

    /// Passes signals on to this process, also one that has come already. Returns a name for it.
    pub(crate) fn pass_on_to(process: &Child) -> i32 {
        pass_on_from_now(process.id() as libc::pid_t)
    }

    /// The same for all processes of a group, which is named by its first one.
    pub(crate) fn pass_on_to_group(first: &Child) -> i32 {
        pass_on_from_now(-(first.id() as libc::pid_t))
    }

    fn pass_on_from_now(id: libc::pid_t) -> i32 {
        let mut children = children();
        children.push(id);
        let before = LAST.load(Ordering::SeqCst) as i32;
        if before != 0 {
            send(id, before);
        }
        id
    }

    pub(crate) fn stop_passing_on(id: i32) {
        children().retain(|child| *child != id);
    }

    /// How a program has ended with this exit status.
    pub(crate) fn words_of(code: i32) -> String {
        format!("has ended with the exit status {code}")
    }

    /// A crash is a signal, and has no exit status.
    pub(crate) fn is_crash(_: i32) -> bool {
        false
    }

    /// The signal that has ended a process.
    pub(crate) fn name_in(status: ExitStatus) -> String {
        let what = |signal| match signal {
            libc::SIGSEGV => " (memory that is not the program's)",
            libc::SIGFPE => " (a division by zero)",
            libc::SIGABRT => " (abort)",
            libc::SIGKILL => " (it was killed)",
            _ => "",
        };
        match status.signal() {
            Some(signal) => match signal_name(signal) {
                Some(name) => format!("{name}{}", what(signal)),
                None => format!("signal {signal}{}", what(signal)),
            },
            None => status.to_string(),
        }
    }
}

#[cfg(not(unix))]
mod windows {
    use std::process::{Child, Command, ExitStatus};
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::{io, thread};

    static CAME: AtomicBool = AtomicBool::new(false);

    /// A console passes Ctrl-C to all of its processes, so the program needs nothing from this one, which
    /// goes on until the program has ended.
    pub(crate) fn take_up() -> io::Result<()> {
        let came = || {
            if !CAME.swap(true, Ordering::SeqCst) {
                let _ = thread::Builder::new().spawn(super::end_unread_words);
            }
        };
        ctrlc::set_handler(came).map_err(io::Error::other)
    }

    pub(crate) fn let_suspend_it(_: &mut Command) {}

    /// A console suspends nothing.
    pub(crate) fn take_up_pauses() -> io::Result<()> {
        Ok(())
    }

    pub(crate) fn is_to_pause(_: &Child) -> bool {
        false
    }

    pub(crate) fn pause() {}

    pub(crate) fn came() -> Option<&'static str> {
        CAME.load(Ordering::SeqCst).then_some("Ctrl-C")
    }

    pub(crate) fn pass_on_to(_: &Child) -> i32 {
        0
    }

    pub(crate) fn pass_on_to_group(_: &Child) -> i32 {
        0
    }

    pub(crate) fn stop_passing_on(_: i32) {}

    /// How a program has ended with this exit status.
    pub(crate) fn words_of(code: i32) -> String {
        match super::name_of_status(code) {
            Some(name) => format!("was ended by {name}"),
            None => format!("has ended with the exit status {code}"),
        }
    }

    pub(crate) fn is_crash(code: i32) -> bool {
        super::name_of_status(code).is_some()
    }

    pub(crate) fn name_in(status: ExitStatus) -> String {
        status.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crash_on_windows_has_words() {
        let name = |status: u32| name_of_status(status as i32);
        assert!(name(0xC000_0005).unwrap().contains("access violation"));
        assert!(name(0xC000_00FD).unwrap().contains("stack overflow"));
        assert!(name(0xC000_0094).unwrap().contains("division by zero"));
        assert_eq!([0, 1, 3, 0xC000_0001].map(name), [None; 4]);
    }
}
