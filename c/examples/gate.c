/*
 * A gate. It opens when its button is pressed, stays open for a second and closes. It ends after two openings.
 * A program that was downloaded to a ROBO TX: PrgInit is called once, then PrgTic every millisecond.
 *
 *   M1  encoder motor, forward opens the gate; its encoder is on C1
 *   I1  switch, pressed while the gate is closed
 *   I3  button
 *   O7  lamp, on while the gate is not closed
 *
 *   cargo run --bin tx_run -- c/examples/gate.c --world c/examples/gate.toml   (a simulated TXT)
 *   cargo run --bin tx_run -- c/examples/gate.c --host 192.168.7.2             (a TXT)
 */
#include "ROBO_TX_PRG.h"

#define OPENINGS 2
#define OPEN_MS  1000
#define PULSES   150 /* of C1, from closed to open */

enum State { HOMING, RESETTING, CLOSED, OPENING, OPEN, CLOSING };

static enum State state;
static UINT32 opened_at;
static int openings;

static void set_motor(TA *ta, int forward, int backward)
{
    ta->output.duty[0] = (INT16) forward;
    ta->output.duty[1] = (INT16) backward;
}

static void show(TA *ta, char *text)
{
    ta->hook_table.DisplayMsg(ta, NULL);
    ta->hook_table.DisplayMsg(ta, text);
}

void PrgInit(TA *p_ta_array, int ta_count)
{
    TA *ta = &p_ta_array[TA_LOCAL];

    ta->config.motor[0] = TRUE;  /* M1 */
    ta->config.motor[3] = FALSE; /* O7 and O8 */
    ta->config.uni[0].mode = MODE_R;
    ta->config.uni[0].digital = TRUE;
    ta->config.uni[2].mode = MODE_R;
    ta->config.uni[2].digital = TRUE;
    ta->state.config_id++;

    show(ta, "Closing the gate");
    state = HOMING;
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    TA *ta = &p_ta_array[TA_LOCAL];

    switch (state) {
    case HOMING: /* after a start the gate may be anywhere */
        set_motor(ta, 0, DUTY_MAX);
        if (ta->input.uni[0]) {
            set_motor(ta, 0, 0);
            ta->input.cnt_resetted[0] = FALSE;
            ta->output.cnt_reset_cmd_id[0]++;
            state = RESETTING;
        }
        break;

    case RESETTING:
        if (ta->input.cnt_resetted[0]) {
            show(ta, "Press the button");
            state = CLOSED;
        }
        break;

    case CLOSED:
        if (ta->input.uni[2]) {
            ta->output.duty[6] = DUTY_MAX; /* O7 */
            ta->input.motor_pos_reached[0] = FALSE;
            ta->output.distance[0] = PULSES;
            ta->output.motor_ex_cmd_id[0]++;
            set_motor(ta, DUTY_MAX, 0);
            state = OPENING;
        }
        break;

    case OPENING:
        if (ta->input.motor_pos_reached[0]) {
            char text[DISPL_MSG_LEN_MAX + 1];

            ta->hook_table.sprintf(text, "Open after %d pulses", ta->input.counter[0]);
            show(ta, text);
            ta->output.distance[0] = 0; /* the motor turns freely again */
            ta->output.motor_ex_cmd_id[0]++;
            set_motor(ta, 0, 0);
            opened_at = ta->hook_table.GetSystemTime(TIMER_UNIT_MILLISECONDS);
            state = OPEN;
        }
        break;

    case OPEN:
        if (ta->hook_table.GetSystemTime(TIMER_UNIT_MILLISECONDS) - opened_at >= OPEN_MS) {
            state = CLOSING;
        }
        break;

    case CLOSING:
        set_motor(ta, 0, DUTY_MAX);
        if (ta->input.uni[0]) {
            set_motor(ta, 0, 0);
            ta->output.duty[6] = 0;
            openings++;
            if (openings == OPENINGS) {
                return 0; /* the end */
            }
            show(ta, "Press the button");
            state = CLOSED;
        }
        break;
    }
    return 0x7FFF; /* call again */
}
