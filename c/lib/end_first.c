/* Ends all transfers of a program before what waits at its end: functions of atexit, destructors of static objects, and
   the message of an assertion, an exception or a virtual function that is not there, which perhaps nobody reads. With
   the linker's options --wrap=main, --wrap=exit and --wrap=quick_exit these functions are called in their place. It is C
   and C++. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifdef __cplusplus
extern "C" {
#endif

/* In the library ftMscLib. */
void ft_end_transfers(void);

int __real_main(int argc, char **argv, char **environment);
void __real_exit(int status);
void __real_quick_exit(int status);

int __wrap_main(int argc, char **argv, char **environment)
{
    static int has_begun;
    /* The program may call its main, too. */
    int is_first = !has_begun;
    int status;

    has_begun = 1;
    status = __real_main(argc, argv, environment);
    if (is_first)
        ft_end_transfers();
    return status;
}

/* The program may have functions of its own with these names, which return. Where that is known they are not wrapped. */
#ifndef FT_OWN_EXIT
void __wrap_exit(int status)
{
    ft_end_transfers();
    __real_exit(status);
}
#endif

#ifndef FT_OWN_QUICK_EXIT
void __wrap_quick_exit(int status)
{
    ft_end_transfers();
    __real_quick_exit(status);
}
#endif

/* The next ones are in the place of the libraries' own, and dynamic libraries call them, too. Weak, because a library that
   is linked into the program may have them. */
#define IN_PLACE __attribute__((weak, noreturn, visibility("default")))

/* The program's name, in the C library. */
extern char *program_invocation_short_name;

/* A failed assertion. */
IN_PLACE void __assert_fail(const char *what, const char *file, unsigned int line, const char *function);

void __assert_fail(const char *what, const char *file, unsigned int line, const char *function)
{
    ft_end_transfers();
    fprintf(stderr, "%s: %s:%u: %s%sAssertion `%s' failed.\n", program_invocation_short_name, file, line,
            function ? function : "", function ? ": " : "", what);
    abort();
}

/* An assertion for an error's number. */
IN_PLACE void __assert_perror_fail(int error, const char *file, unsigned int line, const char *function);

void __assert_perror_fail(int error, const char *file, unsigned int line, const char *function)
{
    ft_end_transfers();
    fprintf(stderr, "%s:%u: %s: Unexpected error: %s.\n", file, line, function, strerror(error));
    abort();
}

/* A check of libstdc++: std::__glibcxx_assert_fail. It names no file and no condition where nothing may get to. */
IN_PLACE void _ZSt21__glibcxx_assert_failPKciS0_S0_(const char *file, int line, const char *function,
                                                    const char *condition);

void _ZSt21__glibcxx_assert_failPKciS0_S0_(const char *file, int line, const char *function, const char *condition)
{
    __assert_fail(condition ? condition : "false", file ? file : "?", line, function);
}

/* std::terminate and std::set_terminate, if a part of the program is C++: perhaps only a compiled file or a library. */
typedef void (*ft_handler)(void);
__attribute__((weak, noreturn)) void _ZSt9terminatev(void);
__attribute__((weak)) ft_handler _ZSt13set_terminatePFvvE(ft_handler handler);

/* What a virtual function is before its class is there. */
IN_PLACE void __cxa_pure_virtual(void);

void __cxa_pure_virtual(void)
{
    static const char message[] = "pure virtual method called\n";

    ft_end_transfers();
    if (write(2, message, sizeof message - 1) < 0 || !_ZSt9terminatev)
        abort();
    _ZSt9terminatev();
}

static ft_handler terminate_before;

/* An exception that nobody catches: what says so comes afterwards. */
static void end_and_terminate(void)
{
    ft_end_transfers();
    terminate_before();
}

/* Before the constructors of static objects, which may throw one. */
__attribute__((constructor(101))) static void see_exceptions(void)
{
    if (_ZSt13set_terminatePFvvE)
        terminate_before = _ZSt13set_terminatePFvvE(end_and_terminate);
}

#ifdef __cplusplus
}
#endif
