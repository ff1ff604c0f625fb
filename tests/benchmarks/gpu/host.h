// CUDA's words as plain C++: a program of one kernel, thread after thread, on the host.
#include <cmath>
#include <cstdlib>
#include <cstring>
#define __device__
#define __global__
#define __host__
#define __forceinline__ inline
struct Index {
    unsigned x;
};
static Index blockIdx{0}, threadIdx{0}, blockDim{128};
inline void __syncwarp() {}
inline float rsqrtf(float a) { return 1 / sqrtf(a); }
inline unsigned __brev(unsigned a) {
    unsigned r = 0;
    for (int i = 0; i < 32; i++) r |= (a >> i & 1u) << (31 - i);
    return r;
}
using cudaEvent_t = int;
enum { cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost };
template <class T> void cudaMalloc(T **p, size_t n) { *p = static_cast<T *>(malloc(n)); }
inline void cudaMemset(void *p, int value, size_t n) { memset(p, value, n); }
inline void cudaMemcpy(void *to, const void *from, size_t n, int) { memcpy(to, from, n); }
inline void cudaEventCreate(int *) {}
inline void cudaEventRecord(int) {}
inline void cudaEventSynchronize(int) {}
inline void cudaEventElapsedTime(float *time, int, int) { *time = 0; }
inline int cudaGetLastError() { return 0; }
template <class Kernel> void launch(int blocks, Kernel kernel) {
    for (blockIdx.x = 0; blockIdx.x < unsigned(blocks); blockIdx.x++)
        for (threadIdx.x = 0; threadIdx.x < blockDim.x; threadIdx.x++) kernel();
}
