/* Functions with the size of what they write to. Ends with the line that found a mistake, or with 0. */
#include <windows.h>
#define EXPECT(condition) if (!(condition)) return __LINE__

static int formatted(int truncated, char *to, size_t size, const char *format, ...)
{
    int length;
    va_list values;
    va_start(values, format);
    length = truncated ? _vsnprintf_s(to, size, _TRUNCATE, format, values) : vsprintf_s(to, size, format, values);
    va_end(values);
    return length;
}

static int copies(void)
{
    char text[6] = "", *rest = NULL, line[] = ",,a,b;";
    EXPECT(strcpy_s(text, sizeof(text), "12345") == 0 && strcmp(text, "12345") == 0);
    EXPECT(strcpy_s(text, sizeof(text), "123456") == ERANGE && text[0] == 0);
    EXPECT(strcpy_s(NULL, 6, "1") == EINVAL && strcpy_s(text, 0, "1") == EINVAL);
    EXPECT(strcpy_s(text, sizeof(text), NULL) == EINVAL);
    EXPECT(strcpy_s(text, _countof(text), "123") == 0 && strcat_s(text, sizeof(text), "45") == 0);
    EXPECT(strcmp(text, "12345") == 0);
    EXPECT(strcat_s(text, sizeof(text), "6") == ERANGE && text[0] == 0);
    EXPECT(strncpy_s(text, sizeof(text), "123456", 3) == 0 && strcmp(text, "123") == 0);
    EXPECT(strncpy_s(text, sizeof(text), "123456", _TRUNCATE) == STRUNCATE && strcmp(text, "12345") == 0);
    EXPECT(strncpy_s(text, sizeof(text), "123456", 6) == ERANGE && text[0] == 0);
    memset(text, 'x', sizeof(text));
    EXPECT(strcat_s(text, sizeof(text), "1") == EINVAL && text[0] == 0);
    EXPECT(memcpy_s(text, sizeof(text), "ab", 3) == 0 && strcmp(text, "ab") == 0);
    EXPECT(memcpy_s(text, sizeof(text), "abcdefg", 7) == ERANGE && text[0] == 0);
    EXPECT(strcmp(strtok_s(line, ",;", &rest), "a") == 0 && strcmp(strtok_s(NULL, ",;", &rest), "b") == 0);
    EXPECT(strtok_s(NULL, ",;", &rest) == NULL && strtok_s(NULL, ",;", &rest) == NULL);
    return 0;
}

static int prints(void)
{
    char text[6];
    EXPECT(sprintf_s(text, sizeof(text), "%d-%s", 1, "34") == 4 && strcmp(text, "1-34") == 0);
    EXPECT(sprintf_s(text, sizeof(text), "%d", 123456) == -1 && text[0] == 0);
    EXPECT(formatted(FALSE, text, sizeof(text), "%s", "12345") == 5 && strcmp(text, "12345") == 0);
    EXPECT(formatted(TRUE, text, sizeof(text), "%s", "123456") == -1 && strcmp(text, "12345") == 0);
    EXPECT(_snprintf_s(text, sizeof(text), 3, "%d", 12345) == -1 && strcmp(text, "123") == 0);
    EXPECT(_snprintf_s(text, sizeof(text), 3, "%d", 123) == 3 && strcmp(text, "123") == 0);
    EXPECT(_snprintf_s(text, sizeof(text), 9, "%d", 1234567) == -1 && text[0] == 0);
    memset(text, 'x', sizeof(text));
    EXPECT(_snprintf(text, 3, "%d", 12) == 2 && strcmp(text, "12") == 0);
    /* No 0 at the end of what is cut. */
    EXPECT(_snprintf(text, 3, "%d", 456) == 3 && memcmp(text, "456xxx", 6) == 0);
    EXPECT(_snprintf(text, 3, "%d", 7890) == -1 && memcmp(text, "789xxx", 6) == 0);
    return 0;
}

static int numbers(void)
{
    char text[40];
    EXPECT(strcmp(_itoa(-12, text, 10), "-12") == 0 && strcmp(itoa(255, text, 16), "ff") == 0);
    EXPECT(strcmp(_itoa(-1, text, 2), "11111111111111111111111111111111") == 0);
    EXPECT(strcmp(_ltoa(-1L, text, 16), "ffffffff") == 0 && strcmp(_ultoa(7UL, text, 2), "111") == 0);
    EXPECT(_itoa(1, text, 1) == NULL && _itoa(1, NULL, 10) == NULL);
    EXPECT(_itoa_s(1234, text, 5, 10) == 0 && strcmp(text, "1234") == 0);
    EXPECT(_itoa_s(1234, text, 4, 10) == ERANGE && text[0] == 0);
    strcpy_s(text, sizeof(text), "Gate 1");
    EXPECT(strcmp(_strupr(text), "GATE 1") == 0 && strcmp(_strlwr(text), "gate 1") == 0);
    EXPECT(max(3, 4) == 4 && min(3, 4) == 3);
    return 0;
}

static int files_and_time(void)
{
    FILE *file = NULL;
    char text[40];
    time_t time = 0;
    struct tm parts;
    EXPECT(fopen_s(&file, "/none/none", "r") == ENOENT && file == NULL);
    EXPECT(fopen_s(NULL, "a", "r") == EINVAL && fopen_s(&file, NULL, "r") == EINVAL);
    EXPECT(fopen_s(&file, "/dev/null", "r") == 0 && file);
    fclose(file);
    EXPECT(gmtime_s(&parts, &time) == 0 && parts.tm_year == 70 && localtime_s(NULL, &time) == EINVAL);
    EXPECT(asctime_s(text, sizeof(text), &parts) == 0);
    EXPECT(strcmp(text, "Thu Jan 01 00:00:00 1970\n") == 0 && asctime_s(text, 5, &parts) == EINVAL);
    EXPECT(ctime_s(text, sizeof(text), &time) == 0 && strlen(text) == 25);
    return 0;
}

int main(void)
{
    boolean failed = 0;
    int line = copies();
    line = line ? line : prints();
    line = line ? line : numbers();
    line = line ? line : files_and_time();
    return line ? line : failed;
}
