// A program whose signal handler ends the transfer, on a thread that has called the library and never waited in it. A
// callback runs, for which the handler has to wait. The program says whether the library then takes memory from the C
// library, which hangs when the handler has interrupted `malloc`. Before that, a child of this thread calls the library:
// it must not wait for anything that threads of its parent had at that time.
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "windows.h"
#include "common.h"
#include "ROBO_TX_FW.h"
#include "ftMscLib.h"

static volatile sig_atomic_t is_called, is_handling;
static HANDLE device;
static pthread_t handles;

// The library registers values of a thread by this function, which allocates.
extern "C" int __cxa_thread_atexit_impl(void (*end)(void *), void *value, void *library)
{
    typedef int Register(void (*)(void *), void *, void *);
    static Register *const original = (Register *)dlsym(RTLD_NEXT, "__cxa_thread_atexit_impl");
    if (is_handling && pthread_equal(pthread_self(), handles)) {
        _exit(4);
    }
    return original(end, value, library);
}

static void __stdcall on_reached(DWORD, DWORD)
{
    is_called = 1;
    usleep(300000);
}

static void begin_to_handle()
{
    handles = pthread_self();
    is_handling = 1;
}

static void on_end(int)
{
    begin_to_handle();
    ftxStopTransferArea(device);
    ftxCloseDevice(device);
    ftxCloseLib();
    _exit(3);
}

static void *drive(void *)
{
    int status;
    if (fork() == 0) {
        begin_to_handle();
        _exit(ftxStopTransferArea(device) != 0 ? 0 : 5);
    }
    if (wait(&status) < 0 || status != 0) {
        _exit(6);
    }
    StartMotorExCmd(device, TA_LOCAL, 0, 512, 0, 0, 0, 2);
    while (!is_called) {
    }
    raise(SIGINT);
    return NULL;
}

int main()
{
    char port[] = "COM4";
    DWORD error;
    signal(SIGINT, on_end);
    ftxInitLib();
    device = ftxOpenComDevice(port, 38400, &error);
    SetCBMotorExReached(on_reached);
    if (!device || ftxStartTransferArea(device) != 0) {
        return 1;
    }
    pthread_t driver;
    pthread_create(&driver, NULL, drive, NULL);
    pthread_join(driver, NULL);
    return 1;
}
