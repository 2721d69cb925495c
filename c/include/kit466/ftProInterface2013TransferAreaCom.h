/* The classes of kit 4.6.6, with what its header brings along: the keyboard, threads, streams and the namespace
   std. */
#ifndef FT_KIT466_TRANSFER_AREA_COM_H
#define FT_KIT466_TRANSFER_AREA_COM_H

#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <chrono>
#include <future>
#include <iostream>
#include <string>
#include <thread>

#include "../kit/ftProInterface2013TransferAreaCom.h"

using namespace std;

#endif
