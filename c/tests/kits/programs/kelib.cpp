// A program for the TXT itself. The first argument says what it does.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>
#ifndef _WIN32
#include <sys/wait.h>
#endif

#include <thread>

#include "KeLibTxtDl.h"
#include "FtShmem.h"

unsigned int DebugFlags;
FILE *DebugFile;

bool Follow(struct shm_if_s *areas, int count);
static volatile bool is_false;
bool Stop(FISH_X1_TRANSFER *, int)
{
    is_false = true;
    return false;
}
bool TakeAway(FISH_X1_TRANSFER *areas, int)
{
    areas[0].ftX1out.duty[2]++;
    SetTransferAreaCompleteCallback(NULL);
    return true;
}
bool Exit(FISH_X1_TRANSFER *, int)
{
    exit(3);
    return true;
}
bool End(FISH_X1_TRANSFER *, int)
{
    StopTxtDownloadProg();
    return true;
}
static volatile int calls;
// Takes too long once.
bool Block(FISH_X1_TRANSFER *areas, int)
{
    static bool has_blocked;
    calls++;
    if (areas->ftX1in.uni[1] && !has_blocked) {
        has_blocked = true;
        areas->ftX1out.duty[4] = 100;
        usleep(1200000);
    }
    return true;
}
bool Hang(FISH_X1_TRANSFER *, int)
{
    for (;;) {
        sleep(1);
    }
    return true;
}

static void say(const char *line)
{
    puts(line);
    fflush(stdout);
}

static volatile sig_atomic_t asked;

static void ask(int)
{
    asked = 1;
}

// Goes on until its own handler is called.
static int handle_signals()
{
    FISH_X1_TRANSFER *area = GetKeLibTransferAreaMainAddress();
    area->ftX1out.duty[0] = 300;
    say("started");
    while (!asked) {
        usleep(2000);
    }
    area->ftX1out.duty[0] = 200;
    say("asked");
    while (!area->ftX1in.uni[0]) {
        usleep(2000);
    }
    StopTxtDownloadProg();
    return 5;
}

#ifndef _WIN32
// A child that tries everything, and ends in its own way.
static int with_a_child(bool by_exit)
{
    pid_t child = fork();
    if (child == 0) {
        uint8_t byte = 0;
        SetTransferAreaCompleteCallback(NULL);
        bool refused = StartTxtDownloadProg() != KELIB_ERROR_NONE
            && StopTxtDownloadProg() != KELIB_ERROR_NONE && !MotorIOLib_ThreadIsRunning()
            && InitI2C() != KELIB_ERROR_NONE
            && KeLibI2cTransfer(0x18, 1, &byte, 1, &byte, 0) != KELIB_ERROR_NONE
            && GetKeLibTransferAreaMainAddress() != NULL;
        if (!by_exit) {
            raise(SIGTERM);
        }
        exit(refused ? 7 : 8);
    }
    int status = 0;
    waitpid(child, &status, 0);
    printf("%d %d %d\n", WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status),
           MotorIOLib_ThreadIsRunning(), GetKeLibTransferAreaMainAddress()->ftX1out.duty[0]);
    fflush(stdout);
    return 0;
}
#endif

static void work()
{
    FISH_X1_TRANSFER *area = GetKeLibTransferAreaMainAddress();
    while (!area->ftX1in.uni[0]) {
        usleep(2000);
    }
    say("worked");
}

// Waits for the id of a sound that is to be played without a number of repeats.
static int play_sound(FISH_X1_TRANSFER *area)
{
    area->sTxtOutputs.u16SoundIndex = 5;
    area->sTxtOutputs.u16SoundRepeat = 0;
    uint16_t before = area->sTxtInputs.u16SoundCmdId;
    area->sTxtOutputs.u16SoundCmdId++;
    while (area->sTxtInputs.u16SoundCmdId == before) {
        usleep(1000);
    }
    printf("%d\n", area->sTxtOutputs.u16SoundRepeat);
    return 0;
}

// Whether a motor does nothing and its areas are as at the first start.
static bool is_new(FISH_X1_TRANSFER *area)
{
    FTX1_CONFIG config = FTX1_CONFIG();
    FTX1_OUTPUT output = FTX1_OUTPUT();
    return area->ftX1state.config_id == 0 && area->ftX1in.motor_ex_reached[0] == 0
        && area->ftX1in.cnt_resetted[0] == 0 && memcmp(&area->ftX1config, &config, sizeof config) == 0
        && memcmp(&area->ftX1out, &output, sizeof output) == 0;
}

// Configures an input, and commands a reset and a distance.
static void command(FISH_X1_TRANSFER *area, int config_id, int distance)
{
    area->ftX1config.uni[0].mode = MODE_R;
    area->ftX1state.config_id = config_id;
    area->ftX1out.distance[0] = distance;
    area->ftX1out.motor_ex_cmd_id[0] = 7;
    area->ftX1out.cnt_reset_cmd_id[0] = 3;
    area->ftX1out.duty[0] = 512;
}

static int start_again(FISH_X1_TRANSFER *area)
{
    if (!is_new(area)) {
        return 3;
    }
    command(area, 1, 5);
    while (!area->ftX1in.motor_ex_reached[0] || !area->ftX1in.cnt_resetted[0] || calls == 0) {
        usleep(1000);
    }
    uint32_t stopped = StopTxtDownloadProg();
    if (area->ftX1in.motor_ex_cmd_id[0] != 7 || area->ftX1in.motor_ex_cmd_id[1] != 0) {
        return 4;
    }
    uint32_t started = StartTxtDownloadProg();
    bool is_as_new = is_new(area);
    int before = calls;
    area->ftX1out.motor_ex_cmd_id[0] = 1;
    while (area->ftX1in.motor_ex_cmd_id[0] != 1) {
        usleep(1000);
    }
    printf("%u %u %d %d\n", (unsigned)stopped, (unsigned)started, is_as_new, calls - before);
    printf("%u", (unsigned)StopTxtDownloadProg());
    printf(" %u\n", (unsigned)StopTxtDownloadProg());
    return 0;
}

// The second start comes in the middle of a distance; afterwards the motor turns without end, then for a distance.
static int start_twice(FISH_X1_TRANSFER *area)
{
    usleep(1200000);
    command(area, 5, 5000);
    while (area->ftX1in.counter[0] < 20 || !area->ftX1in.cnt_resetted[0]) {
        usleep(1000);
    }
    unsigned started = StartTxtDownloadProg();
    printf("%X %d %d %d\n", started, is_new(area), area->IFTimer.Timer1s, MotorIOLib_ThreadIsRunning());
    fflush(stdout);
    int before = calls;
    while (!area->ftX1in.uni[7] || calls < before + 10) {
        usleep(1000);
    }
    printf("%d %d\n", is_new(area), area->ftX1in.motor_ex_cmd_id[0]);
    fflush(stdout);
    area->ftX1out.duty[0] = 512;
    while (area->ftX1in.uni[7]) {
        usleep(1000);
    }
    area->ftX1out.distance[0] = 20;
    area->ftX1out.motor_ex_cmd_id[0] = 1;
    while (!area->ftX1in.motor_ex_reached[0]) {
        usleep(1000);
    }
    printf("%d %d\n", area->ftX1in.motor_ex_cmd_id[0], area->ftX1in.counter[0] >= 20);
    return 0;
}

// A program that gives its configuration a number, and one that raises it, after what is not to be sent.
static int configure(FISH_X1_TRANSFER *area)
{
    area->ftX1config.uni[0].mode = MODE_R2;
    say("not sent");
    while (!area->ftX1in.uni[7]) {
        usleep(1000);
    }
    area->ftX1config.uni[0].mode = MODE_ULTRASONIC;
    area->ftX1state.config_id = 1;
    say("1");
    while (area->ftX1in.uni[7]) {
        usleep(1000);
    }
    area->ftX1config.uni[0].mode = MODE_R;
    area->ftX1config.uni[0].digital = 1;
    area->ftX1config.uni[1].mode = MODE_ULTRASONIC;
    area->ftX1config.uni[1].digital = 1;
    area->ftX1config.uni[2].mode = MODE_R2;
    area->ftX1config.uni[2].digital = 1;
    area->ftX1state.config_id++;
    say("2");
    while (!area->ftX1in.uni[7]) {
        usleep(1000);
    }
    return 0;
}

// The flag of a first command is still 1 when the second one is on its way.
static int keep_flags(FISH_X1_TRANSFER *area)
{
    area->ftX1out.duty[0] = 512;
    area->ftX1out.distance[0] = 10;
    area->ftX1out.motor_ex_cmd_id[0]++;
    area->ftX1out.cnt_reset_cmd_id[1]++;
    while (!area->ftX1in.motor_ex_reached[0] || !area->ftX1in.cnt_resetted[1]) {
        usleep(1000);
    }
    area->ftX1out.distance[0] = 50;
    area->ftX1out.motor_ex_cmd_id[0]++;
    area->ftX1out.cnt_reset_cmd_id[1]++;
    while (area->ftX1in.motor_ex_cmd_id[0] != 2 || area->ftX1in.cnt_reset_cmd_id[1] != 2) {
        if (!area->ftX1in.motor_ex_reached[0] || !area->ftX1in.cnt_resetted[1]) {
            return 3;
        }
    }
    say("stayed");
    return 0;
}

// Duties that no right program gives, and both outputs of a motor.
static int set_odd_duties(FISH_X1_TRANSFER *area)
{
    const int duties[] = {513, 0, 767, 0, -2, 0, 300, 200};
    for (int i = 0; i < 8; i++) {
        area->ftX1out.duty[i] = duties[i];
    }
    say("set");
    while (!area->ftX1in.uni[7]) {
        usleep(1000);
    }
    return 0;
}

// The target is then reached later.
static int reset_in_a_distance(FISH_X1_TRANSFER *area)
{
    area->ftX1out.duty[0] = 512;
    area->ftX1out.distance[0] = 200;
    area->ftX1out.motor_ex_cmd_id[0]++;
    while (area->ftX1in.counter[0] < 50) {
        usleep(1000);
    }
    area->ftX1out.cnt_reset_cmd_id[0]++;
    while (!area->ftX1in.cnt_resetted[0]) {
        usleep(1000);
    }
    printf("%d", area->ftX1in.motor_ex_reached[0]);
    while (!area->ftX1in.motor_ex_reached[0]) {
        usleep(1000);
    }
    printf(" %d\n", area->ftX1in.counter[0] >= 200);
    return 0;
}

// M2 has done its distance when the callback blocks, M1 has not.
static int block_in_a_distance(FISH_X1_TRANSFER *area)
{
    area->ftX1out.duty[2] = 512;
    area->ftX1out.distance[1] = 20;
    area->ftX1out.motor_ex_cmd_id[1]++;
    while (!area->ftX1in.motor_ex_reached[1]) {
        usleep(1000);
    }
    SetTransferAreaCompleteCallback(Block);
    area->ftX1out.duty[0] = 512;
    area->ftX1out.distance[0] = 1000;
    area->ftX1out.motor_ex_cmd_id[0]++;
    say("started");
    while (!area->ftX1in.motor_ex_reached[0]) {
        usleep(1000);
    }
    printf("%d %d\n", area->ftX1in.motor_ex_cmd_id[0], area->ftX1in.motor_ex_cmd_id[1]);
    fflush(stdout);
    while (area->ftX1in.uni[1]) {
        usleep(1000);
    }
    return 0;
}

static int transfer_i2c()
{
    uint8_t write[2] = {0x10, 0x55}, read[2] = {0, 0};
    printf(" %X", (unsigned)KeLibI2cTransfer(0x18, 1, write, 1, read, 0));
    printf(" %X\n", (unsigned)InitI2C());
    printf("%X\n", (unsigned)KeLibI2cTransfer(0x18, 2, write, 0, NULL, I2C_SPEED_400_KHZ));
    printf("%X", (unsigned)KeLibI2cTransfer(0x18, 1, write, 1, read, I2C_SPEED_100_KHZ));
    printf(" %X\n", read[0]);
    printf("%X\n", (unsigned)KeLibI2cTransfer(0x19, 1, write, 0, NULL, 0));
    printf("%X\n", (unsigned)KeLibI2cTransfer(0x19, 1, write, 1, read, 0));
    write[0] = 0x11;
    write[1] = 0x66;
    printf("%X", (unsigned)KeLibI2cTransfer(0x18, 2, write, 0, NULL, 0));
    write[0] = 0x10;
    printf(" %X", (unsigned)KeLibI2cTransfer(0x18, 1, write, 0, NULL, 0));
    printf(" %X", (unsigned)KeLibI2cTransfer(0x18, 0, NULL, 2, read, 0));
    printf(" %X %X\n", read[0], read[1]);
    printf("%X\n", (unsigned)KeLibI2cTransfer(0x18, 0, NULL, 0, NULL, 0));
    printf("%X\n", (unsigned)KeLibI2cTransfer(0x18, 1, NULL, 0, NULL, 0));
    uint8_t many[1025] = {0};
    printf("%X", (unsigned)KeLibI2cTransfer(0x18, 300, many, 0, NULL, 0));
    printf(" %X", (unsigned)InitI2C());
    printf(" %X", (unsigned)KeLibI2cTransfer(0x18, 1, write, 1, read, 0));
    printf(" %X\n", (unsigned)KeLibI2cTransfer(0xF0, 1, write, 0, NULL, 0));
    for (int i = 0; i < 50; i++) {
        KeLibI2cTransfer(0x18, 1025, many, 0, NULL, 0);
    }
    printf("%X", (unsigned)KeLibI2cTransfer(0x18, 1025, many, 0, NULL, 0));
    StopTxtDownloadProg();
    printf(" %X\n", (unsigned)KeLibI2cTransfer(0x18, 1, write, 1, read, 0));
    printf("%X", (unsigned)InitI2C());
    printf(" %X\n", (unsigned)KeLibI2cTransfer(0x18, 1, write, 1, read, 0));
    return 0;
}

// Transfers after its first start, which makes I2C possible, and its second, which does not.
static int transfer_without_init(void)
{
    uint8_t byte = 0;
    for (int i = 0; i < 2; i++) {
        printf("%X\n", (unsigned)KeLibI2cTransfer(0x18, 1, &byte, 1, &byte, 0));
        StopTxtDownloadProg();
        if (StartTxtDownloadProg() != KELIB_ERROR_NONE) {
            return 3;
        }
    }
    printf("%X", (unsigned)InitI2C());
    printf(" %X\n", (unsigned)KeLibI2cTransfer(0x18, 1, &byte, 1, &byte, 0));
    return 0;
}

#ifndef _WIN32
// Calls for I2C once, and begins to exchange at each signal.
static int start_after_i2c()
{
    uint8_t byte = 0;
    signal(SIGUSR1, ask);
    printf("%X\n", (unsigned)InitI2C());
    fflush(stdout);
    for (int i = 0; i < 3; i++) {
        while (!asked || MotorIOLib_ThreadIsRunning()) {
            usleep(1000);
        }
        asked = 0;
        printf("%X", (unsigned)StartTxtDownloadProg());
        printf(" %d", MotorIOLib_ThreadIsRunning());
        printf(" %X\n", (unsigned)KeLibI2cTransfer(0x18, 1, &byte, 1, &byte, 0));
        fflush(stdout);
    }
    return StopTxtDownloadProg() != 1;
}
#endif

// Plays a sound, or ends one with index 0; the id that has come back. On a busy computer the expected one comes later; no
// other one comes within 0.2 s.
static int sound(FISH_X1_TRANSFER *area, int index, int expected)
{
    area->sTxtOutputs.u16SoundIndex = index;
    area->sTxtOutputs.u16SoundRepeat = 1000;
    area->sTxtOutputs.u16SoundCmdId++;
    for (int i = 0; i < 10000 && area->sTxtInputs.u16SoundCmdId != expected; i++) {
        usleep(1000);
    }
    usleep(200000);
    return area->sTxtInputs.u16SoundCmdId;
}

// Ends a sound while none plays, one that plays, none after a file that does not exist, and one that has taken the
// place of another.
static int end_sounds(FISH_X1_TRANSFER *area)
{
    const int indexes[] = {0, 6, 0, 99, 0, 6, 7, 0}, expected[] = {0, 0, 3, 3, 3, 3, 7, 8};
    for (int i = 0; i < 8; i++) {
        printf("%d ", sound(area, indexes[i], expected[i]));
    }
    printf("\n");
    return 0;
}

int main(int argc, char *argv[])
{
    const char *what = argc > 1 ? argv[1] : "";
    FISH_X1_TRANSFER *area = GetKeLibTransferAreaMainAddress();
    if (area == NULL || MotorIOLib_ThreadIsRunning()) {
        return 2;
    }
    if (strcmp(what, "again") == 0) {
        // The first stays, the others do not.
        SetTransferAreaCompleteCallback(Block);
        area->ftX1out.duty[0] = 100;
        area->ftX1config.uni[0].mode = MODE_R;
        area->ftX1state.config_id = 5;
        if (StopTxtDownloadProg() != 1) {
            return 4;
        }
        SetTransferAreaCompleteCallback(Block);
    }
    if (strcmp(what, "i2c") == 0) {
        uint8_t byte = 0;
        printf("%X", (unsigned)KeLibI2cTransfer(0x18, 1, &byte, 1, &byte, 0));
        printf(" %X", (unsigned)InitI2C());
        printf(" %X", (unsigned)KeLibI2cTransfer(0x18, 1, &byte, 1, &byte, 0));
        printf(" %d", MotorIOLib_ThreadIsRunning());
    }
    if (strcmp(what, "handler first") == 0) {
        signal(SIGINT, ask);
    }
#ifndef _WIN32
    if (strcmp(what, "start after I2C") == 0) {
        return start_after_i2c();
    }
#endif
    uint32_t error = StartTxtDownloadProg();
    if (error != KELIB_ERROR_NONE) {
        printf("%X\n", (unsigned)error);
        return area->ftX1state.config_id;
    }
    if (area != GetKeLibTransferAreaMainAddress()) {
        return 1;
    }
    if (strcmp(what, "i2c") == 0) {
        return transfer_i2c();
    }
    if (strcmp(what, "i2c at once") == 0) {
        return transfer_without_init();
    }
    if (strcmp(what, "sound") == 0) {
        return play_sound(area);
    }
    if (strcmp(what, "end sounds") == 0) {
        return end_sounds(area);
    }
    if (strcmp(what, "again") == 0) {
        return start_again(area);
    }
    if (strcmp(what, "twice") == 0) {
        SetTransferAreaCompleteCallback(Block);
        return start_twice(area);
    }
    if (strcmp(what, "config") == 0) {
        return configure(area);
    }
    if (strcmp(what, "flags") == 0) {
        return keep_flags(area);
    }
    if (strcmp(what, "odd duties") == 0) {
        return set_odd_duties(area);
    }
    if (strcmp(what, "reset in a distance") == 0) {
        return reset_in_a_distance(area);
    }
    if (strcmp(what, "block in a distance") == 0) {
        return block_in_a_distance(area);
    }
    if (strcmp(what, "supply") == 0) {
        printf("%d %d %d %d\n", area->sTxtInputs.u16TxtPower, area->sTxtInputs.u16TxtTemp,
               area->sTxtInputs.u16TxtRef, area->sTxtInputs.u16TxtVB);
        return 0;
    }
    if (strcmp(what, "handler later") == 0) {
        signal(SIGINT, ask);
    }
    if (strncmp(what, "handler", 7) == 0) {
        return handle_signals();
    }
    if (strcmp(what, "motor") == 0) {
        area->ftX1config.uni[0].mode = MODE_R;
        area->ftX1config.uni[0].digital = 1;
        area->ftX1state.config_id++;
        area->ftX1out.distance[0] = 100;
        area->ftX1out.motor_ex_cmd_id[0]++;
        area->ftX1out.duty[0] = 512;
        while (area->ftX1in.motor_ex_cmd_id[0] < area->ftX1out.motor_ex_cmd_id[0]) {
            usleep(1000);
        }
        printf("%d\n", area->ftX1in.motor_ex_reached[0]);
        area->sTxtOutputs.u16SoundIndex = 3;
        area->sTxtOutputs.u16SoundRepeat = 1;
        area->sTxtOutputs.u16SoundCmdId++;
        while (area->sTxtInputs.u16SoundCmdId != area->sTxtOutputs.u16SoundCmdId) {
            usleep(1000);
        }
        say("sound");
        StopTxtDownloadProg();
        return MotorIOLib_ThreadIsRunning() || area->ftX1out.duty[0] != 0;
    }
    area->ftX1out.duty[0] = 300;
    say("started");
#ifndef _WIN32
    if (strcmp(what, "fork") == 0) {
        return with_a_child(true);
    }
    if (strcmp(what, "fork and signal") == 0) {
        return with_a_child(false);
    }
#endif
    while (strcmp(what, "turn") == 0) {
        usleep(2000);
    }
    if (strcmp(what, "leave") == 0) {
        pthread_exit(NULL);
    }
    if (strcmp(what, "leave a thread") == 0) {
        std::thread(work).detach();
        pthread_exit(NULL);
    }
    if (strcmp(what, "follow") == 0) {
        SetTransferAreaCompleteCallback(Follow);
        while (!area->ftX1in.uni[7]) {
            usleep(5000);
        }
        SetTransferAreaCompleteCallback(NULL);
        area->ftX1out.duty[0] = 0;
        area->ftX1out.duty[1] = 77;
        while (area->ftX1in.uni[7]) {
            usleep(5000);
        }
        return StopTxtDownloadProg() != 1;
    }
    while (strcmp(what, "hang") == 0 && !area->ftX1in.uni[1]) {
        usleep(2000);
    }
    SetTransferAreaCompleteCallback(strcmp(what, "stop") == 0   ? Stop
                                    : strcmp(what, "away") == 0 ? TakeAway
                                    : strcmp(what, "end") == 0  ? End
                                    : strcmp(what, "hang") == 0 ? Hang
                                    : strcmp(what, "block") == 0 ? Block
                                    : strcmp(what, "exit") == 0 ? Exit
                                                                : NULL);
    if (strcmp(what, "hang") == 0) {
        sleep(1);
        return 0;
    }
    while (!area->ftX1in.uni[0] && MotorIOLib_ThreadIsRunning()) {
        usleep(2000);
    }
    if (is_false && area->ftX1out.duty[0] != 0) {
        return 3;
    }
    say(MotorIOLib_ThreadIsRunning() ? "input" : "ended");
    if (strcmp(what, "stay") == 0) {
        sleep(60);
    }
    if (strcmp(what, "crash") == 0) {
        abort();
    }
    return 0;
}

bool Follow(FISH_X1_TRANSFER *areas, int count)
{
    areas[0].ftX1out.duty[0] = areas[0].ftX1in.uni[0] ? 512 : 0;
    return count == 9;
}
