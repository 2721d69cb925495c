/* Behind each %s, %c and %[ comes the size. Ends with the line that found a mistake, or with 0. */
#include <stdio.h>
#include <string.h>
#include <conio.h>
#define EXPECT(condition) if (!(condition)) return __LINE__

static int texts(void)
{
    char word[6] = "", other[6] = "", letter = 0, pair[2] = {'x', 'x'};
    int number = 0, end = 0;
    double value = 0;
    long long large = 0;
    EXPECT(sscanf_s("12 motor 3.5", "%d %s %lf", &number, word, (unsigned) sizeof(word), &value) == 3);
    EXPECT(number == 12 && strcmp(word, "motor") == 0 && value == 3.5);
    EXPECT(sscanf_s("motor1 5", "%s %d", word, sizeof(word), &number) == 0 && word[0] == 0);
    EXPECT(sscanf_s("12345 abcdef 5", "%d %s %d", &number, word, 6, &end) == 1 && number == 12345 && word[0] == 0);
    EXPECT(sscanf_s("abcdef 5", "%5s%s", word, 6, other, 6) == 2);
    EXPECT(strcmp(word, "abcde") == 0 && strcmp(other, "f") == 0);
    EXPECT(sscanf_s("abcdef", "%9s", word, 6) == 0 && word[0] == 0);
    EXPECT(sscanf_s("q7", "%c%d", &letter, 1, &number) == 2 && letter == 'q' && number == 7);
    EXPECT(sscanf_s("xyz", "%2c%c", pair, 2, &letter, 1) == 2 && pair[0] == 'x' && pair[1] == 'y' && letter == 'z');
    EXPECT(sscanf_s("1xyz", "%d%3c", &number, pair, 2) == 1);
    EXPECT(sscanf_s("[a]=b c", "[%[^]]]=%[a-c ]", word, 6, other, 6) == 2);
    EXPECT(strcmp(word, "a") == 0 && strcmp(other, "b c") == 0);
    EXPECT(sscanf_s("]x", "%[]x]", word, 6) == 1 && strcmp(word, "]x") == 0);
    EXPECT(sscanf_s("5 skipped 6%", "%d%*s%d%%%n", &number, &end, &end) == 2 && end == 12);
    EXPECT(sscanf_s("abc skipped", "%*s%s", word, 6) == 0 && word[0] == 0);
    EXPECT(sscanf_s("12345678901", "%I64d", &large) == 1 && large == 12345678901LL);
    EXPECT(sscanf_s("x", "%d%s", &number, word, 6) == 0 && sscanf_s("", "%s", word, 6) == EOF);
    EXPECT(sscanf_s("a", "%s", word, 0) == 0 && sscanf_s(NULL, "%s", word, 6) == EOF);
    /* What no place has is not read. */
    EXPECT(sscanf_s("a b", "%s %", word, 6) == 1);
    return 0;
}

static int lines(void)
{
    char word[6] = "", letter = 0, line[8] = "";
    int number = 0;
    EXPECT(scanf_s("%d%c", &number, &letter, 1) == 2 && number == 17 && letter == '\n');
    EXPECT(scanf_s("%5s", word, (unsigned) _countof(word)) == 1 && strcmp(word, "start") == 0);
    EXPECT(fscanf_s(stdin, " %c ", &letter, 1u) == 1 && letter == 'y');
    EXPECT(gets_s(line, sizeof(line)) == line && strcmp(line, "M 1 on") == 0);
    EXPECT(gets_s(line, sizeof(line)) == NULL && line[0] == 0);
    EXPECT(scanf_s("%s", word, 6) == EOF);
    return 0;
}

int main(void)
{
    int line = texts();
    return line ? line : lines();
}
