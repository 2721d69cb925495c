/* Keys by their numbers, as windows.h has them, for other systems. */
#ifndef FT_POSIX_WINUSER_H
#define FT_POSIX_WINUSER_H

#include "../detail/ft_windows_types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define VK_LBUTTON 0x01
#define VK_RBUTTON 0x02
#define VK_BACK 0x08
#define VK_TAB 0x09
#define VK_RETURN 0x0D
#define VK_SHIFT 0x10
#define VK_CONTROL 0x11
#define VK_MENU 0x12
#define VK_PAUSE 0x13
#define VK_CAPITAL 0x14
#define VK_ESCAPE 0x1B
#define VK_SPACE 0x20
#define VK_PRIOR 0x21
#define VK_NEXT 0x22
#define VK_END 0x23
#define VK_HOME 0x24
#define VK_LEFT 0x25
#define VK_UP 0x26
#define VK_RIGHT 0x27
#define VK_DOWN 0x28
#define VK_INSERT 0x2D
#define VK_DELETE 0x2E
#define VK_NUMPAD0 0x60
#define VK_NUMPAD1 0x61
#define VK_NUMPAD2 0x62
#define VK_NUMPAD3 0x63
#define VK_NUMPAD4 0x64
#define VK_NUMPAD5 0x65
#define VK_NUMPAD6 0x66
#define VK_NUMPAD7 0x67
#define VK_NUMPAD8 0x68
#define VK_NUMPAD9 0x69
#define VK_MULTIPLY 0x6A
#define VK_ADD 0x6B
#define VK_SUBTRACT 0x6D
#define VK_DECIMAL 0x6E
#define VK_DIVIDE 0x6F
#define VK_F1 0x70
#define VK_F2 0x71
#define VK_F3 0x72
#define VK_F4 0x73
#define VK_F5 0x74
#define VK_F6 0x75
#define VK_F7 0x76
#define VK_F8 0x77
#define VK_F9 0x78
#define VK_F10 0x79
#define VK_F11 0x7A
#define VK_F12 0x7B
#define VK_LSHIFT 0xA0
#define VK_RSHIFT 0xA1
#define VK_LCONTROL 0xA2
#define VK_RCONTROL 0xA3
#define VK_OEM_PLUS 0xBB
#define VK_OEM_COMMA 0xBC
#define VK_OEM_MINUS 0xBD
#define VK_OEM_PERIOD 0xBE

/* Whether a key is down: the highest bit, and whether it was pressed since the last question: the lowest. A terminal
   does not tell when a key goes up, so one counts as down for 0.15 s after each of its characters. Keys without a
   character, such as shift, are never down; neither is any without a terminal. */
SHORT GetAsyncKeyState(int key);
SHORT GetKeyState(int key);

/* A message at the console, which waits for a key: Enter is the first button, n No, Esc Cancel or No. When there are no
   keys it is the last one. */
#define MB_OK 0x0U
#define MB_OKCANCEL 0x1U
#define MB_YESNOCANCEL 0x3U
#define MB_YESNO 0x4U
#define MB_RETRYCANCEL 0x5U
#define MB_ICONERROR 0x10U
#define MB_ICONSTOP 0x10U
#define MB_ICONHAND 0x10U
#define MB_ICONQUESTION 0x20U
#define MB_ICONWARNING 0x30U
#define MB_ICONEXCLAMATION 0x30U
#define MB_ICONINFORMATION 0x40U
#define MB_ICONASTERISK 0x40U
#define MB_SETFOREGROUND 0x10000U
#define MB_TOPMOST 0x40000U
#define IDOK 1
#define IDCANCEL 2
#define IDRETRY 4
#define IDYES 6
#define IDNO 7
int MessageBoxA(HWND window, LPCSTR text, LPCSTR title, UINT kind);
#define MessageBox MessageBoxA

/* A tone: the terminal's bell. Both return TRUE; the first waits as long as the tone lasts. */
BOOL Beep(DWORD frequency, DWORD milliseconds);
BOOL MessageBeep(UINT kind);

#ifdef __cplusplus
}
#endif

#endif
