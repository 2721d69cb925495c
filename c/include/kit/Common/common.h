/* For programs that include ../Common/common.h, with this folder on the include path. */
#include "../common.h"
