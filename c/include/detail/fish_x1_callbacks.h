/* Callbacks of Bluetooth and I2C, as the headers of the TXT declare them. No function takes one: the TXT's hook
   table is empty. */
#ifndef FT_FISH_X1_CALLBACKS_H
#define FT_FISH_X1_CALLBACKS_H

#include "callback_data.h"

struct shm_if_s;

typedef void (*P_CB_FUNC)(struct shm_if_s *area, BT_CB *data);
typedef void (*P_RECV_CB_FUNC)(struct shm_if_s *area, BT_RECV_CB *data);
typedef void (*P_I2C_CB_FUNC)(struct shm_if_s *area, I2C_CB *data);

#endif
