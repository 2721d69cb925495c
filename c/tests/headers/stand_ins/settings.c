/* Settings in a file, and the time. Ends with the line that found a mistake, or with 0. */
#include <stdio.h>
#include <windows.h>
#include <mmsystem.h>
#define EXPECT(condition) if (!(condition)) return __LINE__

static int keeps(const char *file)
{
    char text[20], names[20];
    EXPECT(GetPrivateProfileString("Motor", "duty", "none", text, sizeof(text), file) == 4 && !strcmp(text, "none"));
    EXPECT(WritePrivateProfileString("Motor", "duty", "300", file));
    EXPECT(WritePrivateProfileString("Motor", "name", "\"M 1\"", file));
    EXPECT(WritePrivateProfileString("Gate", "open", "0x10", file));
    EXPECT(WritePrivateProfileString("motor", "DUTY", "-400", file));
    EXPECT(GetPrivateProfileString("MOTOR", "Duty", "", text, sizeof(text), file) == 4 && !strcmp(text, "-400"));
    EXPECT(GetPrivateProfileString("Motor", "name", "", text, sizeof(text), file) == 3 && !strcmp(text, "M 1"));
    EXPECT(GetPrivateProfileString("Motor", "name", "", text, 3, file) == 2 && !strcmp(text, "M "));
    EXPECT((int) GetPrivateProfileInt("Motor", "duty", 5, file) == -400);
    EXPECT(GetPrivateProfileInt("Gate", "open", 5, file) == 16 && GetPrivateProfileInt("Gate", "shut", 5, file) == 5);
    EXPECT(GetPrivateProfileString("Motor", NULL, "", names, sizeof(names), file) == 10);
    EXPECT(!memcmp(names, "DUTY\0name\0", 11));
    EXPECT(GetPrivateProfileString(NULL, NULL, "", names, sizeof(names), file) == 11);
    EXPECT(!memcmp(names, "Motor\0Gate\0", 12));
    EXPECT(GetPrivateProfileString(NULL, NULL, "", names, 12, file) == 11 && !memcmp(names, "Motor\0Gate\0", 12));
    EXPECT(GetPrivateProfileString(NULL, NULL, "", names, 11, file) == 9 && !memcmp(names, "Motor\0Gat\0", 11));
    EXPECT(GetPrivateProfileString("none", NULL, "", names, sizeof(names), file) == 0 && !memcmp(names, "\0", 2));
    EXPECT(WritePrivateProfileString("Motor", "name", NULL, file));
    EXPECT(WritePrivateProfileString("Gate", NULL, NULL, file));
    EXPECT(GetPrivateProfileString(NULL, NULL, "", names, sizeof(names), file) == 6);
    EXPECT(!WritePrivateProfileString("a", "b", "c", "/none/none.ini"));
    return 0;
}

int main(int count, char **arguments)
{
    SYSTEMTIME local, world;
    DWORD before = timeGetTime();
    EXPECT(timeBeginPeriod(1) == TIMERR_NOERROR);
    GetLocalTime(&local);
    GetSystemTime(&world);
    GetLocalTime(NULL);
    EXPECT(local.wYear >= 2024 && local.wMonth >= 1 && local.wMonth <= 12 && local.wDay >= 1 && local.wDay <= 31);
    EXPECT(local.wDayOfWeek < 7 && local.wHour < 24 && local.wMinute < 60 && local.wMilliseconds < 1000);
    EXPECT(world.wYear + 1 >= local.wYear && Beep(440, 20));
    EXPECT(timeGetTime() - before >= 20 && timeEndPeriod(1) == TIMERR_NOERROR);
    EXPECT(count == 2);
    ExitProcess(keeps(arguments[1]));
    return 1;
}
