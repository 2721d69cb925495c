/* For programs that include ../Common/FtShmemTxt.h, with this folder on the include path. */
#include "../FtShmemTxt.h"
