/* For programs that include ../Common/FtShmem.h, with this folder on the include path. */
#include "../FtShmem.h"
