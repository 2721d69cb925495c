#include "line/Axis.h"

#include <unistd.h>

using namespace line;

Axis::Axis(const char *name, FISH_X1_TRANSFER *area, int motor, int reference, int distance)
    : Station(name, area), motor(motor), reference(reference), distance(distance)
{
    area->ftX1config.motor[motor] = 1;
    area->ftX1config.uni[reference].mode = MODE_R;
    area->ftX1config.uni[reference].digital = 1;
    area->ftX1state.config_id++;
}

bool Axis::goes_on() const { return !ends && MotorIOLib_ThreadIsRunning(); }

void Axis::move(int output, int distance)
{
    area->ftX1out.distance[motor] = distance;
    area->ftX1out.motor_ex_cmd_id[motor]++;
    area->ftX1out.duty[2 * motor] = output == 0 ? 512 : 0;
    area->ftX1out.duty[2 * motor + 1] = output == 1 ? 512 : 0;
}

void Axis::run()
{
    move(0, 0);
    while (!pressed(area, reference) && goes_on()) usleep(10000);
    area->ftX1out.duty[2 * motor] = 0;
    area->ftX1in.cnt_resetted[motor] = 0;
    area->ftX1out.cnt_reset_cmd_id[motor]++;
    while (area->ftX1in.cnt_reset_cmd_id[motor] < area->ftX1out.cnt_reset_cmd_id[motor] && goes_on()) usleep(10000);
    move(1, distance);
    while (area->ftX1in.motor_ex_cmd_id[motor] < area->ftX1out.motor_ex_cmd_id[motor] && goes_on()) usleep(10000);
}
