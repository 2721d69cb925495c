/* The classes of the kits 4.1.6 and 4.6.6. The areas are the program's, and in the first class the loop is, too:
   each DoTransfer... exchanges the areas once and returns with the response, which the controller sends 10 ms
   after the one before. The second class has a thread for that. false is any failure; the reason is written to
   the standard error.
   If the environment variable FT_TXT_HOST is set, it replaces the host and the port that the program gives. */
#ifndef FT_KIT_TRANSFER_AREA_COM_H
#define FT_KIT_TRANSFER_AREA_COM_H

#ifdef _WIN32
#include <winsock2.h>
#else
#include "../posix/winsock2.h"
#endif

#include <stddef.h>
#include <stdio.h>

#include "common.h"
#include "FtShmemTxt.h"

extern "C" {
struct ft_kit;
struct ft_kit *ft_kit_new(FISH_X1_TRANSFER *areas, int count, const char *host, const char *port);
void ft_kit_free(struct ft_kit *kit);
UINT32 ft_kit_version(struct ft_kit *kit);
int ft_kit_begin(struct ft_kit *kit);
int ft_kit_update_config(struct ft_kit *kit);
int ft_kit_transfer(struct ft_kit *kit, int compressed);
void ft_kit_end(struct ft_kit *kit);
int ft_kit_start_thread(struct ft_kit *kit, int compressed);
int ft_kit_stop_thread(struct ft_kit *kit);
int ft_kit_thread_runs(struct ft_kit *kit);
size_t ft_kit_line(const FISH_X1_TRANSFER *area, char *text, size_t size);
int ft_kit_start_camera(struct ft_kit *kit, int width, int height, int framerate, int power_line,
                        const char *port);
void ft_kit_stop_camera(struct ft_kit *kit);
int ft_kit_frame(struct ft_kit *kit, unsigned char **buffer, size_t *size);
}

class ftIF2013TransferAreaComHandler
{
public:
    /* Sets the default configuration in the areas, which stay the program's and must outlive the handler:
       all inputs digital switches, all counters normal, all outputs motors. */
    ftIF2013TransferAreaComHandler(FISH_X1_TRANSFER *transferarea, int nAreas = 1,
                                   const char *name = "192.168.7.2", const char *port = "65000")
        : m_transferarea(transferarea), m_nAreas(nAreas),
          m_kit(ft_kit_new(transferarea, nAreas, name, port)), m_compressed(true)
    {
    }

    /* Ends a transfer that runs. */
    ~ftIF2013TransferAreaComHandler() { ft_kit_free(m_kit); }

    /* The firmware's version, such as 0x04060600; 0 when the controller does not answer. */
    UINT32 GetVersion() { return ft_kit_version(m_kit); }

    /* Connects, and sends the configuration of all areas. */
    bool BeginTransfer() { return ft_kit_begin(m_kit) != 0; }
    bool UpdateConfig() { return ft_kit_update_config(m_kit) != 0; }
    bool DoTransferSimple() { return ft_kit_transfer(m_kit, 0) != 0; }
    bool DoTransferCompressed() { return ft_kit_transfer(m_kit, 1) != 0; }
    /* Which exchange DoTransfer and the thread use; compressed without this call. The simple one is for the
       master alone. */
    void SetTransferMode(bool Compressed) { m_compressed = Compressed; }
    bool DoTransfer() { return ft_kit_transfer(m_kit, m_compressed ? 1 : 0) != 0; }
    void EndTransfer() { ft_kit_end(m_kit); }

    void PrintIO(int master_ext)
    {
        char line[200];
        if (m_transferarea != NULL && master_ext >= 0 && master_ext < m_nAreas
            && ft_kit_line(&m_transferarea[master_ext], line, sizeof line) != 0) {
            puts(line);
            fflush(stdout);
        }
    }

    bool StartCamera(int width = 320, int height = 240, int framerate = 15, int powerlinefreq = 50,
                     const char *port = "65001")
    {
        return ft_kit_start_camera(m_kit, width, height, framerate, powerlinefreq, port) != 0;
    }
    void StopCamera() { ft_kit_stop_camera(m_kit); }

    /* Waits for the next frame. The buffer is the handler's, and valid until the next call. */
    bool GetCameraFrameJpeg(unsigned char **buffer, size_t *buffersize)
    {
        return ft_kit_frame(m_kit, buffer, buffersize) != 0;
    }

protected:
    FISH_X1_TRANSFER *m_transferarea;
    int m_nAreas;
    struct ft_kit *m_kit;
    bool m_compressed;

private:
    ftIF2013TransferAreaComHandler(const ftIF2013TransferAreaComHandler &);
    ftIF2013TransferAreaComHandler &operator=(const ftIF2013TransferAreaComHandler &);
};

/* The class of kit 4.6.6 with a thread. The program reads and writes the areas meanwhile, without a lock, and
   sets cnt_resetted and motor_ex_reached back itself. */
class ftIF2013TransferAreaComHandlerEx : public ftIF2013TransferAreaComHandler
{
public:
    ftIF2013TransferAreaComHandlerEx(FISH_X1_TRANSFER *transferarea, int nAreas = 1,
                                     const char *name = "192.168.7.2", const char *port = "65000")
        : ftIF2013TransferAreaComHandler(transferarea, nAreas, name, port)
    {
    }

    /* Begins the transfer, and exchanges the areas in a thread. 0; 1 when the thread runs already; 2 when the
       transfer does not begin. */
    int TaComThreadStart() { return ft_kit_start_thread(m_kit, m_compressed ? 1 : 0); }
    /* Ends both. 0; 1 when there is no thread. */
    int TaComThreadStop() { return ft_kit_stop_thread(m_kit); }
    /* false also after the connection was lost. */
    bool TaComThreadIsRunning() { return ft_kit_thread_runs(m_kit) != 0; }
};

#endif
