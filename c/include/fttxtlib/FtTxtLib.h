/* All of FtTxtLib. */
#ifndef FT_FTTXTLIB_H
#define FT_FTTXTLIB_H

#include "common.h"
#include "ftProInterface2013TransferAreaCom.h"
#include "ftProInterface2013TransferAreaComEx2.h"
#include "ftProInterface2013JpegDecode.h"

#endif
