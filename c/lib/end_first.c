/* Ends all transfers of a program before what waits at its end: functions of atexit, destructors of static objects, and
   the message of an assertion, an exception or a virtual function that is not there, which perhaps nobody reads. With
   the linker's options --wrap=main, --wrap=exit, --wrap=quick_exit and --wrap=__assert_fail these functions are called in
   their place. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __cplusplus
#include <exception>
#include <unistd.h>

extern "C" {
#endif

/* In the library ftMscLib. */
void ft_end_transfers(void);

int __real_main(int argc, char **argv, char **environment);
void __real_exit(int status) __attribute__((noreturn));
void __real_quick_exit(int status) __attribute__((noreturn));
void __real___assert_fail(const char *what, const char *file, unsigned int line, const char *function)
    __attribute__((noreturn));

int __wrap_main(int argc, char **argv, char **environment)
{
    int status = __real_main(argc, argv, environment);

    ft_end_transfers();
    return status;
}

__attribute__((noreturn)) void __wrap_exit(int status)
{
    ft_end_transfers();
    __real_exit(status);
}

__attribute__((noreturn)) void __wrap_quick_exit(int status)
{
    ft_end_transfers();
    __real_quick_exit(status);
}

__attribute__((noreturn)) void __wrap___assert_fail(const char *what, const char *file, unsigned int line,
                                                    const char *function)
{
    ft_end_transfers();
    __real___assert_fail(what, file, line, function);
}

/* These are in the place of the libraries' own. Weak, because a library that is linked into the program may have them,
   too. */

/* An assertion for an error's number. */
__attribute__((weak, noreturn)) void __assert_perror_fail(int error, const char *file, unsigned int line,
                                                          const char *function);

void __assert_perror_fail(int error, const char *file, unsigned int line, const char *function)
{
    ft_end_transfers();
    fprintf(stderr, "%s:%u: %s: Unexpected error: %s.\n", file, line, function, strerror(error));
    abort();
}

#ifdef __cplusplus
/* A check of libstdc++: std::__glibcxx_assert_fail. It names no file and no condition where nothing may get to. */
__attribute__((weak, noreturn)) void _ZSt21__glibcxx_assert_failPKciS0_S0_(const char *file, int line,
                                                                           const char *function, const char *condition);

void _ZSt21__glibcxx_assert_failPKciS0_S0_(const char *file, int line, const char *function, const char *condition)
{
    __wrap___assert_fail(condition ? condition : "false", file ? file : "?", line, function);
}

/* What a virtual function is before its class is there. */
__attribute__((weak, noreturn)) void __cxa_pure_virtual(void);

void __cxa_pure_virtual(void)
{
    static const char message[] = "pure virtual method called\n";

    ft_end_transfers();
    if (write(2, message, sizeof message - 1) < 0) {
        /* It ends all the same. */
    }
    std::terminate();
}
}

static std::terminate_handler terminate_before;

/* An exception that nobody catches: what says so comes afterwards. */
static void end_and_terminate()
{
    ft_end_transfers();
    terminate_before();
}

/* Before the constructors of static objects, which may throw one. */
__attribute__((constructor(101))) static void see_exceptions()
{
    terminate_before = std::set_terminate(end_and_terminate);
}
#endif
