/* Decodes a frame of the camera. */
#ifndef FT_KIT_JPEG_DECODE_H
#define FT_KIT_JPEG_DECODE_H

#include <stddef.h>

#include "common.h"

extern "C" int ft_jpeg_decode(const UINT8 *jpeg, size_t size, UINT8 *yuv, size_t yuv_size, size_t *read);

/* Decodes to YUV 4:2:2, interleaved. bytes_read is the length of the picture without its end marker. */
inline bool ftProJpegDec(const UINT8 *jpegdata, int jpegsize, UINT8 *yuvdata, int yuvsize,
                         size_t *bytes_read)
{
    return jpegsize >= 0 && yuvsize >= 0
           && ft_jpeg_decode(jpegdata, (size_t)jpegsize, yuvdata, (size_t)yuvsize, bytes_read) != 0;
}

#endif
