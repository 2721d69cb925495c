/* Colours, cursor and title; then keys, until Escape. Without a terminal there is nothing of them. */
#include <stdio.h>
#include <windows.h>

static void shows(HANDLE output)
{
    COORD home = {4, 2}, first = {0, 0};
    CONSOLE_CURSOR_INFO cursor;
    CONSOLE_SCREEN_BUFFER_INFO info;
    DWORD written = 0, size;
    printf("before ");
    SetConsoleTextAttribute(output, FOREGROUND_RED | FOREGROUND_INTENSITY);
    printf("red ");
    SetConsoleTitle(TEXT("Gate\n1"));
    SetConsoleCursorPosition(output, home);
    if (GetConsoleScreenBufferInfo(output, &info)) {
        size = (DWORD) info.dwSize.X * (DWORD) info.dwSize.Y;
        FillConsoleOutputCharacter(output, ' ', size, first, &written);
        FillConsoleOutputAttribute(output, info.wAttributes, size, first, &written);
        printf("%d %d %d %d\n", info.wAttributes, info.dwCursorPosition.X, info.dwCursorPosition.Y, written == size);
    }
    if (GetConsoleCursorInfo(output, &cursor)) {
        cursor.bVisible = FALSE;
        SetConsoleCursorInfo(output, &cursor);
    }
    system("title two");
    printf("shown\n");
    fflush(stdout);
}

int main(void)
{
    HANDLE output = GetStdHandle(STD_OUTPUT_HANDLE);
    if (output == INVALID_HANDLE_VALUE || output == GetStdHandle(STD_INPUT_HANDLE)
        || GetStdHandle(0) != INVALID_HANDLE_VALUE || SetConsoleTextAttribute(INVALID_HANDLE_VALUE, 7))
        return 1;
    shows(output);
    if (!SetConsoleTextAttribute(output, FOREGROUND_GREEN))
        return GetAsyncKeyState(VK_ESCAPE) ? 2 : 3;
    while (!GetAsyncKeyState(VK_ESCAPE)) {
        if (GetAsyncKeyState('A') & 1)
            printf("A goes down\n");
        if (GetAsyncKeyState(VK_UP) & 0x8000)
            printf("up is down\n");
        Sleep(5);
    }
    printf("end\n");
    return 0;
}
