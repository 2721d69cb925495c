#include "line\lamp.h"

int lamp_duty(int on)
{
    /* char has no sign, as on the controller. */
    char most = (char) 200;
    return on && most > 0 ? LAMP_DUTY : 0;
}
