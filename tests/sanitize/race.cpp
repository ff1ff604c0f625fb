// A race that the thread sanitizer must report: else it would see none in the native code either.
#include <tbb/parallel_for.h>

int main() {
    int sum = 0;
    tbb::parallel_for(0, 64, [&](int k) { sum += k; });
    return sum < 0;
}
