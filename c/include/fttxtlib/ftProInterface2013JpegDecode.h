/* Decodes a frame of the camera: as in kit 4.1.6. */
#include "../kit/ftProInterface2013JpegDecode.h"
