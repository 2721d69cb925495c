/* A PC program, in C and C++: turns M1 until I1 is pressed, and fills the pipe of its error output, which nobody reads.
   Then an assertion fails, with PERROR one for an error's number, and with CHECK one of the C++ library. In C++ with
   THROW an exception that nobody catches is thrown, with FROM_CALLBACK and FROM_THREAD it leaves a callback of the
   library or a thread, with FROM_CONTROL a function for Ctrl-C, with FROM_CONSTRUCTOR the constructor of a static object, with VIRTUAL a function is called that
   no class has yet, and with AGAIN it becomes itself once more, turns M1 until I2 is pressed, and is killed. With FAILS
   calls fail before, about which the library has more to say than can wait, and M1 turns on until I2 is pressed. With
   ELSEWHERE this is in a part of the program that was compiled before, in C++. */
#define _GNU_SOURCE
#ifdef CHECK
#define _GLIBCXX_ASSERTIONS
#include <vector>
#endif
#include <assert.h>
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>
#include <windows.h>
#include <process.h>
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"

#ifdef ELSEWHERE
void elsewhere(void);
#endif

static void fill(int output)
{
    int flags = fcntl(output, F_GETFL);

    fcntl(output, F_SETFL, flags | O_NONBLOCK);
    while (write(output, "x", 1) == 1)
        ;
    fcntl(output, F_SETFL, flags);
}

#ifdef VIRTUAL
struct Machine {
    Machine() { begin(); }
    void begin() { turn(); }
    virtual void turn() = 0;
};

struct Turntable : Machine {
    void turn() {}
};
#endif

#if defined(FROM_CALLBACK) || defined(FROM_THREAD) || defined(FROM_CONTROL)
/* Its end would stand before the message. */
struct Waits {
    ~Waits() { Sleep(INFINITE); }
};
#endif

#ifdef FROM_CALLBACK
static void __stdcall throws(DWORD controller, DWORD counter)
{
    Waits waits;
    throw 1;
}
#endif

#ifdef FROM_THREAD
static void throws(void *argument)
{
    Waits waits;
    throw 1;
}
#endif

#ifdef FROM_CONTROL
static BOOL WINAPI throws(DWORD event)
{
    Waits waits;
    throw 1;
}
#endif

static int run(int count, char **arguments)
{
    int is_again = count > 1;
    DWORD error = 0;
    INT16 value = 0;
    BOOL32 overrun;
    HANDLE device;

    ftxInitLib();
    device = ftxOpenComDevice("COM4", 38400, &error);
    if (device == NULL || ftxStartTransferArea(device))
        return 1;
    SetOutMotorValues(device, 0, 0, is_again ? 300 : 512, 0);
    while (value == 0) {
        Sleep(10);
        GetInIOValue(device, 0, is_again ? 1 : 0, &value, &overrun);
    }
    if (is_again)
        kill(getpid(), SIGKILL);
    fill(2);
#ifdef FAILS
    OutputDebugString("a line\n");
    ftxOpenComDevice("first", 38400, &error);
    for (int i = 0; i < 600; i++)
        ftxOpenComDevice("second", 38400, &error);
    SetOutMotorValues(device, 0, 0, 300, 0);
    for (value = 0; value == 0; Sleep(10))
        GetInIOValue(device, 0, 1, &value, &overrun);
#endif
#ifdef AGAIN
    execl(arguments[0], arguments[0], "again", (char *)0);
#endif
#if defined(THROW) || defined(FROM_CONSTRUCTOR)
    throw 1;
#endif
#ifdef FROM_CALLBACK
    SetCBCounterResetted(throws);
    StartCounterReset(device, 0, 0);
    Sleep(INFINITE);
#endif
#ifdef FROM_THREAD
    _beginthread(throws, 0, NULL);
    Sleep(INFINITE);
#endif
#ifdef FROM_CONTROL
    SetConsoleCtrlHandler(throws, TRUE);
    kill(getpid(), SIGINT);
    Sleep(INFINITE);
#endif
#ifdef ELSEWHERE
    elsewhere();
#endif
#ifdef PERROR
    assert_perror(5);
#endif
#ifdef CHECK
    std::vector<int> places(3);
    places[7] = 1;
#endif
#ifdef VIRTUAL
    Turntable turntable;
#endif
    assert(is_again);
    return 0;
}

#ifdef FROM_CONSTRUCTOR
static const int status = run(1, NULL);

int main(void)
{
    return status;
}
#else
int main(int count, char **arguments)
{
    return run(count, arguments);
}
#endif
