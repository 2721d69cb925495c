/* What zig asks of Windows and Wine 8 does not have, as a library in place of ntdll: locks that report how they went,
 * the newer ways to remove and rename a file, and what a file is that is named from a folder. */
#include <windows.h>
#include <winternl.h>

enum { BASIC = 4, RENAME = 10, REMOVE = 13, REMOVE_NEWER = 64, RENAME_NEWER = 65 };

NTSTATUS NTAPI NtLockFile(HANDLE, HANDLE, PIO_APC_ROUTINE, void *, IO_STATUS_BLOCK *, LARGE_INTEGER *, LARGE_INTEGER *,
                          ULONG *, BOOLEAN, BOOLEAN);
NTSTATUS NTAPI NtUnlockFile(HANDLE, IO_STATUS_BLOCK *, LARGE_INTEGER *, LARGE_INTEGER *, ULONG *);

NTSTATUS NTAPI lock_file(HANDLE file, HANDLE event, PIO_APC_ROUTINE apc, void *context, IO_STATUS_BLOCK *io,
                         LARGE_INTEGER *from, LARGE_INTEGER *count, ULONG *key, BOOLEAN at_once, BOOLEAN exclusive)
{
    NTSTATUS status = NtLockFile(file, event, apc, context, NULL, from, count, NULL, at_once, exclusive);

    (void)key;
    /* Wine has another name for a lock that somebody else has. */
    return io->Status = status == (NTSTATUS)0xC0000054 ? (NTSTATUS)0xC0000055 : status;
}

NTSTATUS NTAPI unlock_file(HANDLE file, IO_STATUS_BLOCK *io, LARGE_INTEGER *from, LARGE_INTEGER *count, ULONG *key)
{
    (void)key;
    return io->Status = NtUnlockFile(file, NULL, from, count, NULL);
}

NTSTATUS NTAPI set_file(HANDLE file, IO_STATUS_BLOCK *io, void *data, ULONG size, FILE_INFORMATION_CLASS what)
{
    /* The newer ones begin with flags; the lowest is what the older ones have: remove, or replace. */
    BOOLEAN yes = *(ULONG *)data & 1;

    if ((int)what == REMOVE_NEWER)
        return NtSetInformationFile(file, io, &yes, sizeof yes, (FILE_INFORMATION_CLASS)REMOVE);
    if ((int)what == RENAME_NEWER) {
        *(ULONG *)data = yes;
        what = (FILE_INFORMATION_CLASS)RENAME;
    }
    return NtSetInformationFile(file, io, data, size, what);
}

NTSTATUS NTAPI query_file(OBJECT_ATTRIBUTES *name, FILE_BASIC_INFORMATION *basic)
{
    HANDLE file;
    IO_STATUS_BLOCK io;
    NTSTATUS status = NtOpenFile(&file, FILE_READ_ATTRIBUTES, name, &io, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, 0);

    if (status >= 0) {
        status = NtQueryInformationFile(file, &io, basic, sizeof *basic, (FILE_INFORMATION_CLASS)BASIC);
        NtClose(file);
    }
    return status;
}
