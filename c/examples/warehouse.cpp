// A high-bay warehouse: brings containers from their shelves to the belt, and stores them again. The arguments are
// shelves, such as A2 C3; without any it is A1. A program with the class of the C-Programming Kit 4.1.6 and a loop
// of its own. examples/warehouse.rs is its port to Rust, see docs/porting.md.
//
//   M1         belt, with light barriers at its ends: I1 outside, I4 inside
//   M2 with C2 horizontal axis, its reference switch is on I5
//   M3         fork, from I6 (in) to I7 (out)
//   M4 with C4 vertical axis, its reference switch is on I8
//   remote     OFF stops everything. Then the joysticks drive by hand, and ON lets the program go on. ON also says
//              that the workpiece was taken from the container outside; after five seconds it goes in anyway.
//
//   cargo run --bin tx_run -- c/examples/warehouse.cpp --world high_bay_warehouse    (a simulated TXT)
//   cargo run --bin tx_run -- c/examples/warehouse.cpp --host 192.168.7.2            (a TXT)
#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ftProInterface2013TransferAreaCom.h"

#define FULL       512
#define CYCLES(s)  ((int)((s) * 100)) // an exchange takes 10 ms
#define SETTLING   CYCLES(0.2)        // until a motor stands
#define LONGEST    CYCLES(20)         // of a step
#define OFFERED    CYCLES(5)
#define BELL       3
#define HORN       6
#define DEAD_ZONE  4                  // of the joysticks, which go to 15

// Places in pulses from the reference switches. A larger row is lower.
#define SHELVES     3
#define BELT_COLUMN 20
#define BELT_ROW    720
#define LIFT        40
static const int COLUMNS[SHELVES] = {780, 1390, 1995};
static const int ROWS[SHELVES] = {80, 445, 855};

// Terminals, counted from 0.
enum { BELT = 0, FORK = 2 };                                           // M1, M3
enum { OUTSIDE = 0, INSIDE = 3, FORK_IS_IN = 5, FORK_IS_OUT = 6 };     // I1, I4, I6, I7

static FISH_X1_TRANSFER *area;

// --------------------------------------------------------------------------------------------------------- words

// What is to be said: printing may take long, and comes when the outputs are sent.
static char said[500];

static void say(const char *format, ...)
{
    size_t length = strlen(said);
    va_list values;

    va_start(values, format);
    vsnprintf(said + length, sizeof said - length, format, values);
    va_end(values);
}

static void print_said(void)
{
    fputs(said, stdout);
    said[0] = '\0';
}

// ---------------------------------------------------------------------------------------------------- terminals

static bool is_closed(int input)
{
    return area->ftX1in.uni[input] != 0;
}

// There is no light while something is in the way.
static bool is_interrupted(int input)
{
    return area->ftX1in.uni[input] == 0;
}

// Forward is a duty above 0. All axes move forward to their first switch.
static void set_motor(int motor, int duty)
{
    area->ftX1out.duty[2 * motor] = duty > 0 ? duty : 0;
    area->ftX1out.duty[2 * motor + 1] = duty < 0 ? -duty : 0;
}

static void play(int sound)
{
    area->sTxtOutputs.u16SoundIndex = sound;
    area->sTxtOutputs.u16SoundRepeat = 1;
    area->sTxtOutputs.u16SoundCmdId++;
}

// --------------------------------------------------------------------------------------------------------- axes

enum AxisState { STANDS, SEARCHES, TRAVELS, SETTLES };

// A motor with an encoder and a reference switch.
struct Axis {
    int motor;
    int reference;
    enum AxisState state;
    int place;    // in pulses from the reference switch
    int way;      // that it travels; below 0 towards the switch
    int settling; // cycles
    long pulses;  // of all its ways
};

static struct Axis horizontal = {1, 4}; // M2, I5
static struct Axis vertical = {3, 7};   // M4, I8

// A command for a distance; 0 leaves the extended mode.
static void command(int motor, int distance)
{
    area->ftX1out.distance[motor] = distance;
    area->ftX1out.motor_ex_cmd_id[motor]++;
}

static void axis_search(struct Axis *axis)
{
    command(axis->motor, 0);
    set_motor(axis->motor, FULL);
    axis->state = SEARCHES;
}

static void axis_move_to(struct Axis *axis, int place)
{
    axis->way = place - axis->place;
    if (axis->way == 0) {
        axis->state = STANDS;
        return;
    }
    command(axis->motor, abs(axis->way));
    set_motor(axis->motor, axis->way > 0 ? -FULL : FULL);
    axis->state = TRAVELS;
}

static void axis_stop(struct Axis *axis)
{
    command(axis->motor, 0);
    set_motor(axis->motor, 0);
    axis->state = STANDS;
}

// Once in each cycle.
static void axis_tick(struct Axis *axis)
{
    int motor = axis->motor;

    switch (axis->state) {
    case STANDS:
        break;

    case SEARCHES:
        if (is_closed(axis->reference)) {
            set_motor(motor, 0);
            axis->place = 0;
            axis->state = STANDS;
        }
        break;

    case TRAVELS:
        if (area->ftX1in.motor_ex_cmd_id[motor] == area->ftX1out.motor_ex_cmd_id[motor]) {
            set_motor(motor, 0);
            axis->settling = SETTLING;
            axis->state = SETTLES;
        }
        break;

    case SETTLES:
        // It may run on by a few pulses.
        if (--axis->settling == 0) {
            int run = (unsigned short)area->ftX1in.counter[motor];

            axis->place += axis->way > 0 ? run : -run;
            axis->pulses += run;
            axis->state = STANDS;
        }
        break;
    }
}

// --------------------------------------------------------------------------------------------------------- steps

enum Action { TO_SHELF, TO_BELT, FORK_OUT, FORK_IN, BELT_OUT, BELT_IN, OFFER };

struct Step {
    enum Action action;
    int lift;  // of TO_SHELF and TO_BELT: so much lower
    int again; // the step with which it goes on after a stop
    const char *text;
};

static const struct Step STEPS[] = {
    {TO_SHELF, 0, 0, "to the shelf"},
    {FORK_OUT, 0, 0, "fork out"},
    {TO_SHELF, -LIFT, 0, "lift"},
    {FORK_IN, 0, 4, "fork in"},
    {TO_BELT, -LIFT, 4, "to the belt"},
    {FORK_OUT, 0, 4, "fork out"},
    {TO_BELT, LIFT, 4, "lower"},
    {BELT_OUT, 0, 7, "belt out"},
    {FORK_IN, 0, 9, "fork in"},
    {OFFER, 0, 9, "offer"},
    {TO_BELT, 0, 10, "to the belt"},
    {FORK_OUT, 0, 10, "fork out"},
    {BELT_IN, 0, 10, "belt in"},
    {TO_BELT, -LIFT, 10, "lift"},
    {FORK_IN, 0, 15, "fork in"},
    {TO_SHELF, -LIFT, 15, "to the shelf"},
    {FORK_OUT, 0, 15, "fork out"},
    {TO_SHELF, LIFT, 15, "lower"},
    {FORK_IN, 0, 18, "fork in"},
};
#define STEP_COUNT ((int)(sizeof STEPS / sizeof STEPS[0]))

struct Shelf {
    int row;
    int column;
};

enum Mode { FORK_HOMES, AXES_HOME, WORKS, STOPPED, DONE };

static enum Mode mode;
static int step;   // of the order
static int cycles; // of the step
static struct Shelf shelf;
static char **orders;
static int order_count;
static int order;
static int fetched[SHELVES][SHELVES];
static int stops;

static void drive_to(int column, int row)
{
    axis_move_to(&horizontal, column);
    axis_move_to(&vertical, row);
}

static void begin_step(void)
{
    const struct Step *now = &STEPS[step];

    cycles = 0;
    switch (now->action) {
    case TO_SHELF:
        drive_to(COLUMNS[shelf.column], ROWS[shelf.row] + now->lift);
        break;
    case TO_BELT:
        drive_to(BELT_COLUMN, BELT_ROW + now->lift);
        break;
    case FORK_OUT:
        set_motor(FORK, -FULL);
        break;
    case FORK_IN:
        set_motor(FORK, FULL);
        break;
    case BELT_OUT:
        set_motor(BELT, -FULL);
        break;
    case BELT_IN:
        set_motor(BELT, FULL);
        break;
    case OFFER:
        say("%s is outside\n", orders[order]);
        play(BELL);
        break;
    }
}

// Whether the step is done. Then what it has switched on is off again.
static bool step_is_done(bool on_pressed)
{
    switch (STEPS[step].action) {
    case TO_SHELF:
    case TO_BELT:
        return horizontal.state == STANDS && vertical.state == STANDS;
    case FORK_OUT:
        if (!is_closed(FORK_IS_OUT))
            return false;
        set_motor(FORK, 0);
        return true;
    case FORK_IN:
        if (!is_closed(FORK_IS_IN))
            return false;
        set_motor(FORK, 0);
        return true;
    case BELT_OUT:
        if (!is_interrupted(OUTSIDE))
            return false;
        set_motor(BELT, 0);
        return true;
    case BELT_IN:
        if (!is_interrupted(INSIDE))
            return false;
        set_motor(BELT, 0);
        return true;
    case OFFER:
        return on_pressed || cycles >= OFFERED;
    }
    return false;
}

// -------------------------------------------------------------------------------------------------------- orders

// "B2" is row B, column 2. Returns false if there is no such shelf.
static bool read_shelf(const char *name, struct Shelf *read)
{
    if (strlen(name) != 2)
        return false;
    read->row = toupper((unsigned char)name[0]) - 'A';
    read->column = name[1] - '1';
    return read->row >= 0 && read->row < SHELVES && read->column >= 0 && read->column < SHELVES;
}

static void begin_order(void)
{
    if (order == order_count) {
        mode = DONE;
        return;
    }
    read_shelf(orders[order], &shelf); // main has checked it
    say("fetching %s\n", orders[order]);
    step = 0;
    begin_step();
}

static void begin_homing(void)
{
    say("looking for the references\n");
    set_motor(FORK, FULL);
    cycles = 0;
    mode = FORK_HOMES;
}

static void stop_all(const char *reason)
{
    say("stopped: %s, in step \"%s\"\n", reason, step < STEP_COUNT ? STEPS[step].text : "homing");
    axis_stop(&horizontal);
    axis_stop(&vertical);
    set_motor(FORK, 0);
    set_motor(BELT, 0);
    play(HORN);
    stops++;
    mode = STOPPED;
}

// ---------------------------------------------------------------------------------------------------------- hand

// Near the middle a joystick means 0.
static int duty_of(int joystick)
{
    return abs(joystick) < DEAD_ZONE ? 0 : joystick * FULL / 15;
}

// A motor by hand, but not beyond its first switch.
static void drive_by_hand(int motor, int duty, int first_switch)
{
    set_motor(motor, duty > 0 && is_closed(first_switch) ? 0 : duty);
}

static void hand_control(const KE_IR_INPUT_V01 *remote)
{
    int fork = -duty_of(remote->i16JoyLeftY); // up is out

    drive_by_hand(horizontal.motor, -duty_of(remote->i16JoyRightX), horizontal.reference);
    drive_by_hand(vertical.motor, duty_of(remote->i16JoyRightY), vertical.reference);
    if (fork < 0 && is_closed(FORK_IS_OUT))
        fork = 0;
    drive_by_hand(FORK, fork, FORK_IS_IN);
}

// ---------------------------------------------------------------------------------------------------------- loop

static void tick(void)
{
    static bool on_before;
    const KE_IR_INPUT_V01 *remote = &area->sTxtInputs.sIrInput[IR_RECEIVER_IDX_ALL_DATA];
    bool on_pressed = remote->u16ButtonOn && !on_before;

    on_before = remote->u16ButtonOn != 0;
    cycles++;
    if (mode != STOPPED && mode != DONE) {
        if (remote->u16ButtonOff)
            stop_all("OFF was pressed");
        else if (cycles > LONGEST)
            stop_all("it takes too long");
    }
    axis_tick(&horizontal);
    axis_tick(&vertical);

    switch (mode) {
    case FORK_HOMES: // before the axes move
        if (is_closed(FORK_IS_IN)) {
            set_motor(FORK, 0);
            axis_search(&horizontal);
            axis_search(&vertical);
            cycles = 0;
            mode = AXES_HOME;
        }
        break;

    case AXES_HOME:
        if (horizontal.state == STANDS && vertical.state == STANDS) {
            mode = WORKS;
            if (step == STEP_COUNT)
                begin_order();
            else
                begin_step();
        }
        break;

    case WORKS:
        if (!step_is_done(on_pressed))
            break;
        if (++step < STEP_COUNT) {
            begin_step();
            break;
        }
        say("%s is back\n", orders[order]);
        fetched[shelf.row][shelf.column]++;
        order++;
        begin_order();
        break;

    case STOPPED:
        hand_control(remote);
        if (on_pressed) {
            axis_stop(&horizontal);
            axis_stop(&vertical);
            if (step < STEP_COUNT)
                step = STEPS[step].again;
            begin_homing();
        }
        break;

    case DONE:
        break;
    }
}

static void print_result(void)
{
    printf("     1  2  3\n");
    for (int row = 0; row < SHELVES; row++) {
        printf("  %c", 'A' + row);
        for (int column = 0; column < SHELVES; column++)
            printf("%3d", fetched[row][column]);
        printf("\n");
    }
    printf("%d of %d orders, %d stops, ways of %ld and %ld pulses\n", order, order_count, stops, horizontal.pulses,
           vertical.pulses);
}

int main(int argc, char **argv)
{
    static char first[] = "A1";
    static char *default_orders[] = {first};
    FISH_X1_TRANSFER areas[IF08_MAX];

    orders = argc > 1 ? argv + 1 : default_orders;
    order_count = argc > 1 ? argc - 1 : 1;
    for (int i = 0; i < order_count; i++) {
        struct Shelf unused;

        if (!read_shelf(orders[i], &unused)) {
            fprintf(stderr, "there is no shelf %s; there are A1 to C3\n", orders[i]);
            return 1;
        }
    }
    setvbuf(stdout, NULL, _IOLBF, BUFSIZ);
    memset(areas, 0, sizeof areas);
    area = &areas[LOCAL_IO];

    ftIF2013TransferAreaComHandler handler(areas, 1, "192.168.7.2");
    for (int input = 0; input < IZ_UNI_INPUT; input++) {
        area->ftX1config.uni[input].mode = MODE_R;
        area->ftX1config.uni[input].digital = 1;
    }
    if (!handler.BeginTransfer()) {
        fprintf(stderr, "the controller does not answer\n");
        return 1;
    }
    step = STEP_COUNT; // no order is begun
    begin_homing();
    while (mode != DONE) {
        if (!handler.DoTransferCompressed()) {
            fprintf(stderr, "the connection is lost\n");
            return 1;
        }
        print_said();
        tick();
    }
    axis_stop(&horizontal);
    axis_stop(&vertical);
    handler.DoTransferCompressed();
    handler.EndTransfer();
    print_said();
    print_result();
    return 0;
}
