/* The keyboard of a terminal, key by key, as conio.h of Windows has it. */
#ifndef FT_POSIX_CONIO_H
#define FT_POSIX_CONIO_H

#include "ft_windows_c.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Not 0 when a key has been pressed that was not read yet. */
int _kbhit(void);
int kbhit(void);
/* Waits for a key and returns it, without showing it; -1 when there is none any more. A key without a
   character is reported by two calls, the first of which returns 0 or 224. */
int _getch(void);
int getch(void);
/* The same, and shows it. */
int _getche(void);
int getche(void);
/* Shows a character, or a text. */
int _putch(int character);
int putch(int character);
int _cputs(const char *text);
int cputs(const char *text);

#ifdef __cplusplus
}
#endif

#endif
