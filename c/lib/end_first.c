/* Ends all transfers of a program before what waits at its end: functions of atexit, destructors of static objects.
   With the linker's options --wrap=main, --wrap=exit and --wrap=quick_exit these functions are called in their place. */
#ifdef __cplusplus
extern "C" {
#endif

/* In the library ftMscLib. */
void ft_end_transfers(void);

int __real_main(int argc, char **argv, char **environment);
void __real_exit(int status) __attribute__((noreturn));
void __real_quick_exit(int status) __attribute__((noreturn));

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

#ifdef __cplusplus
}
#endif
