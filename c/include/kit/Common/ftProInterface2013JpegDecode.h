/* For programs that include ../Common/ftProInterface2013JpegDecode.h, with this folder on the include path. */
#include "../ftProInterface2013JpegDecode.h"
