/* For programs that include ../Common/ftProInterface2013TransferAreaCom.h, with this folder on the include path. */
#include "../ftProInterface2013TransferAreaCom.h"
