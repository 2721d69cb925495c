//! What the headers for other systems than Windows declare does what it does there.
#![cfg(unix)]

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::compilers::{self, Compiler, Language};
use super::exports::folder;

/// Ends with the line that found a mistake, or with 0.
const THREADS: &str = r#"
#include <windows.h>
#include <process.h>
#define EXPECT(condition) if (!(condition)) return __LINE__
static HANDLE begin, done, mutex;
static CRITICAL_SECTION section;
static int sum;
static void add(void *argument)
{
    int round;
    for (round = 0; round < 1000; round++) {
        EnterCriticalSection(&section);
        EnterCriticalSection(&section);
        sum += *(int *) argument;
        LeaveCriticalSection(&section);
        LeaveCriticalSection(&section);
    }
}
static void once(void *argument)
{
    WaitForSingleObject(begin, INFINITE);
    add(argument);
    SetEvent(done);
}
static DWORD __stdcall with_code(LPVOID argument)
{
    add(argument);
    WaitForSingleObject(mutex, INFINITE);
    return 7;
}
int main(void)
{
    int one = 1;
    DWORD code = 0, id = 0;
    LARGE_INTEGER before, after, per_second;
    HANDLE thread, all[2];
    HMODULE library;
    DWORD ticks = GetTickCount();
    begin = CreateEvent(NULL, TRUE, FALSE, TEXT("begin"));
    done = CreateEvent(NULL, FALSE, FALSE, NULL);
    mutex = CreateMutex(NULL, FALSE, NULL);
    InitializeCriticalSection(&section);
    EXPECT(begin && done && begin != done);
    EXPECT(WaitForSingleObject(done, 0) == WAIT_TIMEOUT);
    EXPECT(_beginthread(once, 0, &one) != (uintptr_t) -1);
    thread = CreateThread(NULL, 0, with_code, &one, 0, &id);
    EXPECT(thread && id && id != GetCurrentThreadId());
    EXPECT(SetEvent(begin));
    all[0] = thread;
    all[1] = done;
    EXPECT(WaitForMultipleObjects(2, all, TRUE, INFINITE) == WAIT_OBJECT_0);
    EXPECT(sum == 2000);
    EXPECT(GetExitCodeThread(thread, &code) && code == 7);
    /* The thread has ended with it. */
    EXPECT(WaitForSingleObject(mutex, 0) == WAIT_ABANDONED && WaitForSingleObject(mutex, 0) == WAIT_OBJECT_0);
    EXPECT(WaitForMultipleObjects(2, all, FALSE, 0) == WAIT_OBJECT_0);
    EXPECT(WaitForSingleObject(done, 0) == WAIT_TIMEOUT);
    EXPECT(WaitForSingleObject(begin, 0) == WAIT_OBJECT_0);
    EXPECT(ResetEvent(begin) && WaitForSingleObject(begin, 1) == WAIT_TIMEOUT);
    EXPECT(CloseHandle(begin) && !CloseHandle(begin) && !SetEvent(begin));
    EXPECT(WaitForSingleObject(begin, INFINITE) == WAIT_FAILED);
    EXPECT(!CloseHandle(NULL) && !ReleaseMutex(done));
    EXPECT(CreateThread(NULL, 0, NULL, NULL, 0, NULL) == NULL);
    EXPECT(QueryPerformanceFrequency(&per_second) && QueryPerformanceCounter(&before));
    Sleep(20);
    EXPECT(QueryPerformanceCounter(&after) && !QueryPerformanceCounter(NULL));
    EXPECT((after.QuadPart - before.QuadPart) * 1000 / per_second.QuadPart >= 20);
    EXPECT(GetTickCount() - ticks >= 20);
    library = LoadLibrary(TEXT("ftMscLib.dll"));
    EXPECT(library && GetProcAddress(library, "Sleep") && !GetProcAddress(library, "Slept"));
    EXPECT(FreeLibrary(library) && !FreeLibrary(NULL) && !LoadLibrary(TEXT("none.dll")));
    return 0;
}
"#;

const KEYS: &str = r#"
#include <stdio.h>
#include <conio.h>
int main(void)
{
    int key;
    while ((key = _getch()) != -1)
        printf("%d %d\n", key, _kbhit() != 0);
    return 0;
}
"#;

/// Ends with the line that found a mistake, or with 0. It asks as programs do that share work between threads.
const PROCESSORS: &str = r#"
#include <stdlib.h>
#include <windows.h>
#define EXPECT(condition) if (!(condition)) return __LINE__
int main(void)
{
    SYSTEM_INFO info;
    DWORD length = 0, wrong = 1, at, cores = 0, groups = 0;
    char *records;
    GetSystemInfo(NULL);
    GetSystemInfo(&info);
    EXPECT(info.dwNumberOfProcessors > 0 && info.dwPageSize >= 4096 && (info.dwActiveProcessorMask & 1));
    EXPECT(!GetLogicalProcessorInformationEx(RelationAll, NULL, &length));
    EXPECT(GetLastError() == ERROR_INSUFFICIENT_BUFFER && length > 0);
    EXPECT(!GetLogicalProcessorInformationEx(RelationAll, NULL, NULL));
    EXPECT(GetLastError() == ERROR_INVALID_PARAMETER);
    records = (char *) malloc(length);
    EXPECT(!GetLogicalProcessorInformationEx(RelationAll, (void *) records, &wrong) && wrong == length);
    EXPECT(GetLogicalProcessorInformationEx(RelationAll, (void *) records, &length) && wrong == length);
    for (at = 0; at < length; ) {
        PSYSTEM_LOGICAL_PROCESSOR_INFORMATION_EX one = (void *) (records + at);
        if (one->Relationship == RelationProcessorCore) {
            EXPECT(one->Processor.GroupCount == 1);
            EXPECT(one->Processor.GroupMask[0].Mask == (KAFFINITY) 1 << cores);
            cores++;
        } else {
            EXPECT(one->Relationship == RelationGroup && one->Group.ActiveGroupCount == 1);
            EXPECT(one->Group.GroupInfo[0].ActiveProcessorMask == info.dwActiveProcessorMask);
            EXPECT(one->Group.GroupInfo[0].ActiveProcessorCount == info.dwNumberOfProcessors);
            groups++;
        }
        at += one->Size;
    }
    EXPECT(at == length && cores == info.dwNumberOfProcessors && groups == 1);
    return 0;
}
"#;

/// Waits for a line, runs a command of the shell, and then reads a line itself.
const PAUSE: &str = r#"
#include <stdio.h>
#include <stdlib.h>
int main(void)
{
    char line[20] = "none";
    int silent, pause;
    printf("one ");
    silent = system("pause>nul");
    pause = system("PAUSE");
    fflush(stdout);
    printf("%d %d %d ", silent, pause, system("exit 3") != 0);
    if (scanf("%19s", line) != 1) printf("no line ");
    printf("%s\n", line);
    return 0;
}
"#;

/// Compiles and links a program.
fn built(source: &str) -> Option<Command> {
    let compiler = compilers::for_c().next()?;
    Some(linked(compiler, &compilers::write(source, Language::C), &[]))
}

/// Compiles and links the program in a file.
pub(crate) fn linked(compiler: &Compiler, file: &Path, options: &[&str]) -> Command {
    let program = file.with_extension("exe");
    let said = compiler
        .command()
        .args(compilers::includes())
        .args(options)
        .arg(file)
        .arg(format!("-L{}", folder().display()))
        .arg("-lftMscLib")
        .arg(format!("-Wl,-rpath,{}", folder().display()))
        .arg("-o")
        .arg(&program)
        .output()
        .unwrap();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    let mut program = Command::new(program);
    // Where tests run it leads to a library that may be older.
    program.env_remove("LD_LIBRARY_PATH");
    program
}

#[test]
fn threads_events_and_locks_work() {
    let Some(mut program) = built(THREADS) else { return };
    let ended = program.status().unwrap();
    assert!(ended.success(), "the check in line {:?} has failed", ended.code());
}

#[test]
fn processors_are_told_as_programs_ask_for_them() {
    let Some(mut program) = built(PROCESSORS) else { return };
    let ended = program.status().unwrap();
    assert!(ended.success(), "the check in line {:?} has failed", ended.code());
}

#[test]
fn pause_waits_for_a_line_and_takes_no_more() {
    for (input, rest) in [("\n\nthree\n", "three"), ("\n", "no line none"), ("", "no line none")] {
        let Some(mut program) = built(PAUSE) else { return };
        let mut child = program.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        let said = format!("one Press any key to continue . . . \n0 0 1 {rest}\n");
        assert_eq!(String::from_utf8_lossy(&output.stdout), said, "{input:?}");
        assert!(output.stderr.is_empty());
    }
}

/// A thread waits for keys, and main only asks.
const ASKS: &str = r#"
#include <conio.h>
#include <process.h>
#include <windows.h>
static void menu(void *unused)
{
    while (_getch() != -1)
        ;
}
int main(void)
{
    int times;
    DWORD waiting = 0;
    _beginthread(menu, 0, NULL);
    for (times = 0; times < 10; times++) {
        Sleep(10);
        if ((GetAsyncKeyState(VK_SPACE) & 0x8000) || _kbhit() || !GetNumberOfConsoleInputEvents(NULL, &waiting) && waiting)
            return 1;
    }
    return 0;
}
"#;

/// Signals interrupt what waits for a key until there are none.
const INTERRUPTED: &str = r#"
#include <conio.h>
#include <signal.h>
#include <sys/time.h>
static void on_alarm(int signal)
{
}
int main(void)
{
    struct itimerval often = {{0, 5000}, {0, 5000}};
    signal(SIGALRM, on_alarm);
    setitimer(ITIMER_REAL, &often, NULL);
    return _getch() == -1 ? 0 : 1;
}
"#;

/// Waits for the end of a program whose input stays open for this time.
fn ends_with_input_for(source: &str, time: Duration) {
    let Some(mut program) = built(source) else { return };
    let mut child = program.stdin(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take();
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if begun.elapsed() > time {
            input = None;
        }
        if begun.elapsed() > time.min(Duration::from_secs(1)) + Duration::from_secs(30) {
            child.kill().unwrap();
            panic!("it does not end");
        }
        thread::sleep(Duration::from_millis(10));
    };
    assert!(status.success(), "{status}");
    drop(input);
}

#[test]
fn a_thread_that_waits_for_a_key_holds_up_nobody_who_only_asks() {
    ends_with_input_for(ASKS, Duration::from_secs(60));
}

#[test]
fn the_end_of_the_input_is_seen_also_when_signals_come() {
    ends_with_input_for(INTERRUPTED, Duration::from_millis(200));
}

/// Keys also come from a file or another program; without any, none waits.
#[test]
fn keys_come_one_by_one() {
    let Some(mut program) = built(KEYS) else { return };
    let mut child = program.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    // Dropped, and so closed, at the end of the line.
    child.stdin.take().unwrap().write_all(b"q\n\x1b[A").unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout), "113 1\n13 1\n224 1\n72 0\n");
}
