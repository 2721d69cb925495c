/* What projects of Visual Studio have beside stdafx.h, for those that are published without it. */
#include "SDKDDKVer.h"
