// A part of a program: an assertion fails, or with THROW an exception is thrown that nobody catches.
#include <cassert>

extern "C" void elsewhere()
{
#ifdef THROW
    throw 1;
#endif
    assert(!"elsewhere");
}
