//! A terminal for programs.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus};
use std::ptr;
use std::thread;
use std::time::{Duration, Instant};

/// Far more than anything here takes.
const DEADLINE: Duration = Duration::from_secs(30);

/// A program at a terminal.
pub(crate) struct AtTerminal {
    pub(crate) child: Child,
    /// Where somebody sits.
    keyboard: Option<File>,
    /// Where the program is.
    terminal: File,
}

impl AtTerminal {
    pub(crate) fn start(command: &mut Command) -> Self {
        let (mut outer, mut inner) = (0, 0);
        // SAFETY: the places for the two ends are this function's.
        let opened = unsafe {
            libc::openpty(&mut outer, &mut inner, ptr::null_mut(), ptr::null_mut(), ptr::null_mut())
        };
        assert_eq!(opened, 0);
        // SAFETY: nobody else has them.
        let [keyboard, terminal] = [outer, inner].map(|end| unsafe {
            libc::fcntl(end, libc::F_SETFD, libc::FD_CLOEXEC);
            File::from(OwnedFd::from_raw_fd(end))
        });
        let [input, output, errors] = [(); 3].map(|()| terminal.try_clone().unwrap());
        command.stdin(input).stdout(output).stderr(errors);
        // SAFETY: two system calls without pointers.
        unsafe {
            command.pre_exec(|| {
                libc::setsid();
                libc::ioctl(libc::STDIN_FILENO, libc::TIOCSCTTY as _, 0);
                Ok(())
            });
        }
        Self { child: command.spawn().unwrap(), keyboard: Some(keyboard), terminal }
    }

    fn keyboard(&self) -> &File {
        self.keyboard.as_ref().expect("the terminal is open")
    }

    /// As its window is closed, or its connection breaks.
    pub(crate) fn close(&mut self) {
        self.keyboard = None;
    }

    pub(crate) fn press(&mut self, keys: &str) {
        self.keyboard().write_all(keys.as_bytes()).unwrap();
    }

    /// Waits until the program has printed this.
    #[track_caller]
    pub(crate) fn expect(&mut self, text: &str) {
        let mut seen = Vec::new();
        let mut byte = [0];
        while !String::from_utf8_lossy(&seen).contains(text) {
            let printed = String::from_utf8_lossy(&seen);
            assert!(self.is_readable(), "never: {text:?}, only {printed}");
            self.keyboard().read_exact(&mut byte).unwrap();
            seen.push(byte[0]);
        }
    }

    /// Waits until there is something to read.
    fn is_readable(&self) -> bool {
        let fd = self.keyboard().as_raw_fd();
        let mut keyboard = libc::pollfd { fd, events: libc::POLLIN, revents: 0 };
        // SAFETY: the place is this function's.
        unsafe { libc::poll(&mut keyboard, 1, DEADLINE.as_millis() as libc::c_int) == 1 }
    }

    /// Waits for the end, also when keys are pressed again and again until then.
    #[track_caller]
    pub(crate) fn end(&mut self, keys: &str) -> ExitStatus {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(begun.elapsed() < DEADLINE, "the program does not end");
            if !keys.is_empty() {
                self.press(keys);
            }
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Whether keys are shown and wait for the end of their line.
    pub(crate) fn has_lines(&self) -> bool {
        // SAFETY: all bits 0 are such a struct, and it is there.
        let settings = unsafe {
            let mut settings: libc::termios = std::mem::zeroed();
            assert_eq!(libc::tcgetattr(self.terminal.as_raw_fd(), &mut settings), 0);
            settings
        };
        settings.c_lflag & (libc::ICANON | libc::ECHO) == libc::ICANON | libc::ECHO
    }
}

impl Drop for AtTerminal {
    fn drop(&mut self) {
        // Nothing is left behind by a test that has failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
