// min and max of windows.h beside those of the standard library. Ends with the line that found a mistake, or with 0.
#include <windows.h>
#include <algorithm>
#include <limits>
#include <random>
#include <valarray>
#include "tchar.h"
#define EXPECT(condition) if (!(condition)) return __LINE__

namespace own {
int max(int one, int other)
{
    return one + other;
}
}

static double min(double one, double other)
{
    return one < other ? one : other;
}

using namespace std;

struct Range {
    int min, max;
};

int main()
{
    static int places[::max(2, 3)];
    short small = 4;
    Range range = { 1, 2 };
    const int all[] = { 3, 1, 2 };
    EXPECT(_countof(places) == 3 && min(3, 5) == 3 && max(3, 5) == 5);
    EXPECT(max(1, 2.5) == 2.5 && min(small, 5) == 4 && max(small, 5L) == 5 && min(1.5, 2.5) == 1.5);
    EXPECT(std::min(3, 5) == 3 && (std::max)(3, 5) == 5 && std::max({ 1, 4, 2 }) == 4 && own::max(1, 2) == 3);
    EXPECT(*max_element(all, all + 3) == 3 && numeric_limits<int>::max() > 1 && range.min < range.max);
    EXPECT(min<long>(2, 3) == 2 && ::max(1u, 2u) == 2);
    EXPECT(__max(1, 2) == 2 && __min(small, 2.5) == 2.5);
    wchar_t wide[3];
    char date[9];
    EXPECT(wcscpy_s(wide, L"ab") == 0 && _strdate_s(date) == 0);
    return 0;
}
