/* Integers of fixed width, under the names that programs for the TX and the TXT use. */
#ifndef FT_TYPES_H
#define FT_TYPES_H

#ifdef _WIN32
/* INT8 to UINT32 as windows.h has them, so that both can be included in either order. */
#include <basetsd.h>
#else
typedef signed char INT8;
typedef signed short INT16;
typedef signed int INT32;
typedef unsigned char UINT8;
typedef unsigned short UINT16;
typedef unsigned int UINT32;
/* The calling conventions of 32-bit Windows mean nothing elsewhere. */
#ifndef __stdcall
#define __stdcall
#endif
#ifndef _stdcall
#define _stdcall
#endif
#ifndef __cdecl
#define __cdecl
#endif
#ifndef _cdecl
#define _cdecl
#endif
#ifndef __fastcall
#define __fastcall
#endif
#endif

typedef signed char CHAR8;
typedef unsigned char UCHAR8;

/* 0 or not 0. */
typedef unsigned char BOOL8;
typedef unsigned short BOOL16;
typedef unsigned int BOOL32;

#endif
