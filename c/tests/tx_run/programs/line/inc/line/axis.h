#ifndef AXIS_H
#define AXIS_H

#include "Station.h"

namespace line {

/* Turns left until its reference switch is pressed, then a distance to the right. */
class Axis : public Station
{
public:
    Axis(const char *name, FISH_X1_TRANSFER *area, int motor, int reference, int distance);

private:
    void run() override;
    void move(int output, int distance);
    bool goes_on() const;
    int motor, reference, distance;
};

} // namespace line

#endif
