/* scanf_s, fscanf_s and sscanf_s, for other systems than Windows. Behind the place of each %s, %c and %[ the program
   gives its size. The C library gets a format with widths in place of the sizes. All that scanf takes are pointers, and
   it ignores those that its format does not need, so it always gets FT_SCAN_MOST of them. */
#ifndef FT_SCANF_S_H
#define FT_SCANF_S_H

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What is behind so many places is not read. */
#define FT_SCAN_MOST 32
/* A longer text fits nowhere, whatever size the program gives. */
#define FT_SCAN_LONGEST 0x100000U

/* A text that is read to a place of its own first, one character more than fits: so too long a text is seen. */
typedef struct {
    char *to;
    char *read;
    size_t size;
    int number;
} ft_scan_text;

typedef struct {
    va_list values;
    char *format;
    char *end;
    void *places[FT_SCAN_MOST];
    ft_scan_text texts[FT_SCAN_MOST];
    int place_count;
    int text_count;
    /* How many values are read so far, as scanf counts them. */
    int value_count;
} ft_scan;

/* A conversion such as %10s. */
typedef struct {
    int is_skipped;
    int is_wide;
    unsigned long width;
    const char *modifier;
    size_t modifier_length;
    /* The letter, or the set of %[, up to the end. */
    const char *kind;
    const char *end;
} ft_scan_conversion;

/* Reads what follows a %. */
static __inline__ ft_scan_conversion ft_scan_parse(const char *at)
{
    ft_scan_conversion found;
    memset(&found, 0, sizeof(found));
    found.is_skipped = *at == '*';
    at += found.is_skipped;
    for (; *at >= '0' && *at <= '9'; at++)
        if (found.width < FT_SCAN_LONGEST)
            found.width = found.width * 10 + (unsigned long) (*at - '0');
    found.modifier = at;
    if (strncmp(at, "I64", 3) == 0) {
        found.modifier = "ll";
        found.modifier_length = 2;
        at += 3;
    } else {
        for (; *at && strchr("hlLqjzt", *at); at++)
            found.modifier_length++;
    }
    found.kind = at;
    found.is_wide = *at == 'S' || *at == 'C' || (found.modifier_length && *found.modifier == 'l');
    if (*at == '[') {
        at += at[1] == '^';
        at += at[1] == ']';
        do at++; while (*at && *at != ']');
    }
    found.end = *at ? at + 1 : at;
    return found;
}

/* Adds a conversion to the format. */
static __inline__ void ft_scan_put(ft_scan *scan, const ft_scan_conversion *one, unsigned long width)
{
    scan->end += sprintf(scan->end, one->is_skipped ? "%%*" : "%%");
    if (width)
        scan->end += sprintf(scan->end, "%lu", width);
    memcpy(scan->end, one->modifier, one->modifier_length);
    scan->end += one->modifier_length;
    memcpy(scan->end, one->kind, (size_t) (one->end - one->kind));
    scan->end += one->end - one->kind;
}

/* Adds one with a size. 0 when nothing fits into its place: then reading ends before it. */
static __inline__ int ft_scan_put_sized(ft_scan *scan, const ft_scan_conversion *one)
{
    char *to = va_arg(scan->values, char *);
    /* Programs give sizeof, too: the processors that this is for pass it in a place that begins like an int's. */
    size_t size = va_arg(scan->values, unsigned);
    size_t most = size < FT_SCAN_LONGEST ? size : FT_SCAN_LONGEST;
    int is_text = *one->kind != 'c' && *one->kind != 'C';
    ft_scan_text *text;
    if (!to || (is_text ? size == 0 || (one->is_wide && size == 1) : size < (one->width ? one->width : 1)))
        return 0;
    scan->places[scan->place_count] = to;
    if (!is_text) {
        ft_scan_put(scan, one, one->width);
    } else if (one->is_wide) {
        ft_scan_put(scan, one, one->width && one->width < most ? one->width : most - 1);
    } else {
        text = &scan->texts[scan->text_count];
        if (one->width && one->width < most)
            most = one->width;
        text->read = (char *) malloc(most + 1);
        if (!text->read)
            return 0;
        text->to = to;
        text->size = size < FT_SCAN_LONGEST ? size : FT_SCAN_LONGEST;
        text->number = scan->value_count;
        scan->text_count++;
        scan->places[scan->place_count] = text->read;
        ft_scan_put(scan, one, most);
    }
    scan->place_count++;
    return 1;
}

/* Adds what is at this place of the program's format, and returns the next place; NULL when reading ends there. */
static __inline__ const char *ft_scan_add(ft_scan *scan, const char *at)
{
    ft_scan_conversion one;
    if (*at != '%' || at[1] == '%') {
        size_t length = *at == '%' ? 2 : 1;
        memcpy(scan->end, at, length);
        scan->end += length;
        return at + length;
    }
    one = ft_scan_parse(at + 1);
    if (!*one.kind || scan->place_count == FT_SCAN_MOST)
        return NULL;
    if (one.is_skipped) {
        ft_scan_put(scan, &one, one.width);
        return one.end;
    }
    if (strchr("sScC[", *one.kind)) {
        if (!ft_scan_put_sized(scan, &one))
            return NULL;
    } else {
        scan->places[scan->place_count++] = va_arg(scan->values, void *);
        ft_scan_put(scan, &one, one.width);
    }
    scan->value_count += *one.kind != 'n';
    return one.end;
}

/* Makes a format and places for scanf. 0 when there is no memory. */
static __inline__ int ft_scan_begin(ft_scan *scan, const char *format, va_list values)
{
    memset(scan, 0, sizeof(*scan));
    /* A conversion has two characters or more, and gets a width of seven digits at most. */
    scan->format = scan->end = (char *) malloc(strlen(format) * 5 + 8);
    if (!scan->format)
        return 0;
    __builtin_va_copy(scan->values, values);
    while (format && *format)
        format = ft_scan_add(scan, format);
    va_end(scan->values);
    *scan->end = 0;
    return 1;
}

/* Gives the program its texts, and returns how many values were read. It is an error when one does not fit. */
static __inline__ int ft_scan_end(ft_scan *scan, int count)
{
    int index;
    for (index = 0; index < scan->text_count; index++) {
        ft_scan_text *text = &scan->texts[index];
        if (text->number < count) {
            size_t length = strlen(text->read);
            if (length < text->size) {
                memcpy(text->to, text->read, length + 1);
            } else {
                text->to[0] = 0;
                count = text->number;
            }
        }
        free(text->read);
    }
    free(scan->format);
    return count;
}

#define FT_SCAN_4(scan, at) \
    (scan).places[at], (scan).places[at + 1], (scan).places[at + 2], (scan).places[at + 3]
#define FT_SCAN_16(scan, at) \
    FT_SCAN_4(scan, at), FT_SCAN_4(scan, at + 4), FT_SCAN_4(scan, at + 8), FT_SCAN_4(scan, at + 12)

static __inline__ int vfscanf_s(FILE *file, const char *format, va_list values)
{
    ft_scan scan;
    if (!file || !format || !ft_scan_begin(&scan, format, values))
        return EOF;
    return ft_scan_end(&scan, fscanf(file, scan.format, FT_SCAN_16(scan, 0), FT_SCAN_16(scan, 16)));
}

static __inline__ int vsscanf_s(const char *text, const char *format, va_list values)
{
    ft_scan scan;
    if (!text || !format || !ft_scan_begin(&scan, format, values))
        return EOF;
    return ft_scan_end(&scan, sscanf(text, scan.format, FT_SCAN_16(scan, 0), FT_SCAN_16(scan, 16)));
}

static __inline__ int fscanf_s(FILE *file, const char *format, ...)
{
    int count;
    va_list values;
    va_start(values, format);
    count = vfscanf_s(file, format, values);
    va_end(values);
    return count;
}

static __inline__ int scanf_s(const char *format, ...)
{
    int count;
    va_list values;
    va_start(values, format);
    count = vfscanf_s(stdin, format, values);
    va_end(values);
    return count;
}

static __inline__ int sscanf_s(const char *text, const char *format, ...)
{
    int count;
    va_list values;
    va_start(values, format);
    count = vsscanf_s(text, format, values);
    va_end(values);
    return count;
}

#ifdef __cplusplus
}
#endif

#endif
