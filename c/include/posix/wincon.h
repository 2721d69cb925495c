/* The console, as windows.h has it, for other systems: colours, the cursor, the title, Ctrl-C. At a terminal they are
   its control sequences. Where the output is no terminal, nothing is written for them. */
#ifndef FT_POSIX_WINCON_H
#define FT_POSIX_WINCON_H

#include "../detail/ft_windows_types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define STD_INPUT_HANDLE ((DWORD) -10)
#define STD_OUTPUT_HANDLE ((DWORD) -11)
#define STD_ERROR_HANDLE ((DWORD) -12)

#define FOREGROUND_BLUE 0x1
#define FOREGROUND_GREEN 0x2
#define FOREGROUND_RED 0x4
#define FOREGROUND_INTENSITY 0x8
#define BACKGROUND_BLUE 0x10
#define BACKGROUND_GREEN 0x20
#define BACKGROUND_RED 0x40
#define BACKGROUND_INTENSITY 0x80
#define COMMON_LVB_REVERSE_VIDEO 0x4000
#define COMMON_LVB_UNDERSCORE 0x8000

#define ENABLE_PROCESSED_INPUT 0x1
#define ENABLE_LINE_INPUT 0x2
#define ENABLE_ECHO_INPUT 0x4
#define ENABLE_PROCESSED_OUTPUT 0x1
#define ENABLE_WRAP_AT_EOL_OUTPUT 0x2
#define ENABLE_VIRTUAL_TERMINAL_PROCESSING 0x4
#define CP_UTF8 65001

#define CTRL_C_EVENT 0
#define CTRL_BREAK_EVENT 1
#define CTRL_CLOSE_EVENT 2
#define CTRL_LOGOFF_EVENT 5
#define CTRL_SHUTDOWN_EVENT 6

typedef struct {
    SHORT X;
    SHORT Y;
} COORD, *PCOORD;
typedef struct {
    SHORT Left;
    SHORT Top;
    SHORT Right;
    SHORT Bottom;
} SMALL_RECT, *PSMALL_RECT;
typedef struct {
    COORD dwSize;
    COORD dwCursorPosition;
    WORD wAttributes;
    SMALL_RECT srWindow;
    COORD dwMaximumWindowSize;
} CONSOLE_SCREEN_BUFFER_INFO, *PCONSOLE_SCREEN_BUFFER_INFO;
typedef struct {
    DWORD dwSize;
    BOOL bVisible;
} CONSOLE_CURSOR_INFO, *PCONSOLE_CURSOR_INFO;

HANDLE GetStdHandle(DWORD which);
BOOL SetConsoleTextAttribute(HANDLE output, WORD attributes);
/* The position is the one that the program has set last. */
BOOL GetConsoleScreenBufferInfo(HANDLE output, PCONSOLE_SCREEN_BUFFER_INFO info);
BOOL SetConsoleCursorPosition(HANDLE output, COORD position);
BOOL GetConsoleCursorInfo(HANDLE output, PCONSOLE_CURSOR_INFO info);
BOOL SetConsoleCursorInfo(HANDLE output, const CONSOLE_CURSOR_INFO *info);
BOOL SetConsoleTitleA(LPCSTR title);
BOOL SetConsoleTitleW(LPCWSTR title);
/* The second one only counts: a terminal can't colour what it shows. */
BOOL FillConsoleOutputCharacterA(HANDLE output, CHAR character, DWORD count, COORD from, DWORD *written);
BOOL FillConsoleOutputAttribute(HANDLE output, WORD attributes, DWORD count, COORD from, DWORD *written);
BOOL WriteConsoleA(HANDLE output, const void *text, DWORD length, DWORD *written, void *reserved);
BOOL FlushConsoleInputBuffer(HANDLE input);
/* How many characters of keys wait. */
BOOL GetNumberOfConsoleInputEvents(HANDLE input, DWORD *count);
/* These change nothing: a terminal knows control sequences and UTF-8. */
BOOL GetConsoleMode(HANDLE console, DWORD *mode);
BOOL SetConsoleMode(HANDLE console, DWORD mode);
BOOL SetConsoleOutputCP(UINT code_page);
BOOL SetConsoleCP(UINT code_page);
UINT GetConsoleOutputCP(void);
UINT GetConsoleCP(void);

/* Ctrl-C, SIGQUIT as Ctrl-Break, SIGTERM and SIGHUP as the end of the console call the program's functions in a
   thread of their own, the last one first. When none returns TRUE, or the console ends, the program ends with its
   motors stopped. Without a function, Ctrl-C is ignored or not. */
typedef BOOL (WINAPI *PHANDLER_ROUTINE)(DWORD event);
BOOL SetConsoleCtrlHandler(PHANDLER_ROUTINE handler, BOOL add);

#if defined(UNICODE) || defined(_UNICODE)
#define SetConsoleTitle SetConsoleTitleW
#else
#define SetConsoleTitle SetConsoleTitleA
#endif
#define FillConsoleOutputCharacter FillConsoleOutputCharacterA
#define WriteConsole WriteConsoleA

#ifdef __cplusplus
}
#endif

#endif
