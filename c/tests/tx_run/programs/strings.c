/* All hooks that the C library has, too. */
#include "ROBO_TX_PRG.h"

static int check(TA_HOOK_TABLE *hook)
{
    char text[40], other[40];
    UCHAR8 address[6] = { 0x00, 0x13, 0x7b, 0x52, 0xb1, 0xfa };

    if (hook->sprintf(text, "%d %s %c %5.2f", -5, "abc", 'x', 2.5) != 14)
        return 1;
    if (hook->strcmp(text, "-5 abc x  2.50") || hook->strlen(text) != 14)
        return 2;
    if (hook->strcpy(other, "AbC") != other || hook->stricmp(other, "aBc") || !hook->strcmp(other, "abc"))
        return 3;
    if (hook->strcmp(hook->strcat(other, "Def"), "AbCDef") || hook->strcmp(hook->strncat(other, "xyz", 1), "AbCDefx"))
        return 4;
    if (hook->strcmp(hook->strupr(other), "ABCDEFX") || hook->strcmp(hook->strlwr(other), "abcdefx"))
        return 5;
    if (hook->strchr(other, 'c') != other + 2 || hook->strrchr(other, 'z') || hook->strrchr(other, 'x') != other + 6)
        return 6;
    if (hook->strncmp(other, "abX", 2) || hook->strncmp(other, "abX", 3) <= 0 || hook->strnicmp(other, "ABX", 2))
        return 7;
    if (hook->strstr(other, "de") != other + 3 || hook->strstr(other, "ed"))
        return 8;
    hook->strncpy(text, "12345", 3);
    if (hook->memcmp(text, "123", 3) || hook->atoi("  42x") != 42 || hook->atoi("-7") != -7)
        return 9;
    hook->strcpy(text, "a,b;c");
    if (hook->strcmp(hook->strtok(text, ",;"), "a") || hook->strcmp(hook->strtok(NULL, ",;"), "b")
        || hook->strcmp(hook->strtok(NULL, ",;"), "c") || hook->strtok(NULL, ",;"))
        return 10;
    hook->memset(text, 'x', 4);
    hook->memcpy(text + 4, "yz", 3);
    hook->memmove(text + 1, text, 7);
    if (hook->strcmp(text, "xxxxxyz"))
        return 11;
    if (hook->strcmp(hook->BtAddrToStr(address, other), "00:13:7b:52:b1:fa"))
        return 12;
    if (!hook->IsRunAllowed() || hook->strlen(NULL) || hook->strcpy(NULL, "a"))
        return 13;
    return 0;
}

static int result;

void PrgInit(TA *p_ta_array, int ta_count)
{
    result = check(&p_ta_array[TA_LOCAL].hook_table);
}

int PrgTic(TA *p_ta_array, int ta_count)
{
    return result;
}
