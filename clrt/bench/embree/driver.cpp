// Embree from C++ in its fastest mode for pictures: packets of 16 rays (4 x 4 pixels) with the coherent flag, tiles of 32 x 32 pixels dealt
// out to threads. Started with the number of threads and a scene file (driver.py writes it); each line on standard input is a run, each line
// on standard output its answer:
//
//   build            the hierarchy anew                                        -> seconds, processor seconds
//   primary W H      the camera's rays, made here; distance and normal kept    -> seconds, processor seconds
//   shadow W H       from those hits that face the light, towards it           -> seconds, processor seconds
//   light W H        the same segments from the light's end                    -> seconds, processor seconds
//   picture W H      primary and shadow rays, packet by packet; one byte kept  -> seconds, processor seconds
//   load FILE        rays in packets: 16 of origin x, y, z, direction x, y, z  -> their number
//   general          the nearest hits of the loaded rays                       -> seconds, processor seconds
//   copy             the same without asking Embree: rays read, distances kept  -> seconds, processor seconds
//   hits             of the last picture: hits, shadow rays, those blocked; and hits of the loaded rays
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <cstddef>
#include <ctime>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>
#include <xmmintrin.h>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

constexpr int N = 16, SIDE = 4, TILE = 32, LIT = 1, ASKED = 2, HIT = 4;
constexpr float FAR = std::numeric_limits<float>::infinity();

struct Scene {
    float eye[3], corner[3], along_row[3], along_column[3], light[3], offset;
    std::vector<std::vector<float>> objects;  // 9 numbers a triangle
    std::vector<std::vector<uint32_t>> indices;
};

static Scene read_scene(const char *path) {
    std::ifstream in(path, std::ios::binary);
    Scene s;
    int32_t objects = 0;
    in.read(reinterpret_cast<char *>(&s), offsetof(Scene, objects));
    in.read(reinterpret_cast<char *>(&objects), 4);
    for (int i = 0; i < objects && in; i++) {
        int32_t triangles = 0;
        in.read(reinterpret_cast<char *>(&triangles), 4);
        std::vector<float> corners(9 * size_t(triangles) + 4);  // Embree reads 16 bytes at each corner
        in.read(reinterpret_cast<char *>(corners.data()), 36 * std::streamsize(triangles));
        std::vector<uint32_t> index(3 * size_t(triangles));
        for (size_t k = 0; k < index.size(); k++) index[k] = uint32_t(k);
        s.objects.push_back(std::move(corners));
        s.indices.push_back(std::move(index));
    }
    if (!in) { std::cerr << "cannot read " << path << "\n"; std::exit(2); }
    return s;
}

// Denormal numbers as zero: what Embree asks of every thread that calls it.
static void quick_floats() { _mm_setcsr(_mm_getcsr() | 0x8040); }

class Threads {
    std::vector<std::thread> workers;
    std::mutex mutex;
    std::condition_variable begin, end;
    std::function<void(int)> job;
    std::atomic<int> next{0};
    int items = 0, round = 0, busy = 0;
    bool stop = false;

    void work() { for (int i; (i = next.fetch_add(1)) < items;) job(i); }
    void wait_and_work() {
        quick_floats();
        for (int seen = 0;;) {
            { std::unique_lock<std::mutex> lock(mutex); begin.wait(lock, [&] { return stop || round != seen; }); if (stop) return; seen = round; }
            work();
            std::lock_guard<std::mutex> lock(mutex);
            if (--busy == 0) end.notify_one();
        }
    }
public:
    explicit Threads(int count) { quick_floats(); for (int i = 1; i < count; i++) workers.emplace_back([this] { wait_and_work(); }); }
    ~Threads() { { std::lock_guard<std::mutex> lock(mutex); stop = true; } begin.notify_all(); for (auto &w : workers) w.join(); }
    void run(int count, std::function<void(int)> each) {
        { std::lock_guard<std::mutex> lock(mutex); job = std::move(each); items = count; next = 0; busy = int(workers.size()); round++; }
        begin.notify_all();
        work();
        std::unique_lock<std::mutex> lock(mutex);
        end.wait(lock, [&] { return busy == 0; });
    }
};

class Tracer {
    const Scene &scene;
    RTCDevice device;
    RTCScene handle = nullptr;
public:
    Tracer(const Scene &s, int threads) : scene(s), device(rtcNewDevice(("threads=" + std::to_string(threads)).c_str())) { build(); }
    ~Tracer() { rtcReleaseScene(handle); rtcReleaseDevice(device); }

    std::string version() const {
        const long v = long(rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION));
        return std::to_string(v / 10000) + "." + std::to_string(v / 100 % 100) + "." + std::to_string(v % 100);
    }
    void build() {
        if (handle) rtcReleaseScene(handle);
        handle = rtcNewScene(device);
        for (size_t i = 0; i < scene.objects.size(); i++) {
            const size_t corners = scene.indices[i].size();
            RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
            rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, scene.objects[i].data(), 0, 12, corners);
            rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, scene.indices[i].data(), 0, 12, corners / 3);
            rtcCommitGeometry(mesh);
            rtcAttachGeometry(handle, mesh);
            rtcReleaseGeometry(mesh);
        }
        rtcCommitScene(handle);
    }
#if RTC_VERSION_MAJOR >= 4
    void intersect(const int *valid, RTCRayHit16 *rays) const {
        RTCIntersectArguments a; rtcInitIntersectArguments(&a);
        a.flags = RTC_RAY_QUERY_FLAG_COHERENT; a.feature_mask = RTC_FEATURE_FLAG_TRIANGLE;
        rtcIntersect16(valid, handle, rays, &a);
    }
    void occluded(const int *valid, RTCRay16 *rays) const {
        RTCOccludedArguments a; rtcInitOccludedArguments(&a);
        a.flags = RTC_RAY_QUERY_FLAG_COHERENT; a.feature_mask = RTC_FEATURE_FLAG_TRIANGLE;
        rtcOccluded16(valid, handle, rays, &a);
    }
#else
    void intersect(const int *valid, RTCRayHit16 *rays) const {
        RTCIntersectContext c; rtcInitIntersectContext(&c); c.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        rtcIntersect16(valid, handle, &c, rays);
    }
    void occluded(const int *valid, RTCRay16 *rays) const {
        RTCIntersectContext c; rtcInitIntersectContext(&c); c.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        rtcOccluded16(valid, handle, &c, rays);
    }
#endif
};

static void begin_hits(RTCRayHit16 &r) {
    for (int k = 0; k < N; k++) {
        r.ray.tnear[k] = 0; r.ray.tfar[k] = FAR; r.ray.time[k] = 0; r.ray.mask[k] = ~0u; r.ray.flags[k] = 0; r.ray.id[k] = k;
        r.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID; r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
}

// The rays of 4 x 4 pixels from (x, y) on, as plain loops that the compiler turns into vectors. valid: -1 within the picture, 0 outside.
static void camera_rays(const Scene &s, int x, int y, int width, int height, RTCRayHit16 &r, int *valid) {
    begin_hits(r);
    for (int k = 0; k < N; k++) {
        const int i = x + k % SIDE, j = y + k / SIDE;
        valid[k] = i < width && j < height ? -1 : 0;
        const float u = (i + 0.5f) / width, v = (j + 0.5f) / height;
        const float dx = s.corner[0] + u * s.along_row[0] + v * s.along_column[0], dy = s.corner[1] + u * s.along_row[1] + v * s.along_column[1],
                    dz = s.corner[2] + u * s.along_row[2] + v * s.along_column[2], scale = 1.0f / std::sqrt(dx * dx + dy * dy + dz * dz);
        r.ray.dir_x[k] = dx * scale; r.ray.dir_y[k] = dy * scale; r.ray.dir_z[k] = dz * scale;
        r.ray.org_x[k] = s.eye[0]; r.ray.org_y[k] = s.eye[1]; r.ray.org_z[k] = s.eye[2];
    }
}

// What shadow rays start from: points put off their surface towards the viewer, and whether the light stands on that side. valid: -1 or 0.
struct alignas(64) Points { float x[N], y[N], z[N], t[N], nx[N], ny[N], nz[N]; int valid[N]; };

static void to_points(const Scene &s, const RTCRayHit16 &r, Points &p) {
    for (int k = 0; k < N; k++) {
        const float dx = r.ray.dir_x[k], dy = r.ray.dir_y[k], dz = r.ray.dir_z[k];
        float nx = p.nx[k], ny = p.ny[k], nz = p.nz[k];
        const float length = 1.0f / std::sqrt(nx * nx + ny * ny + nz * nz), side = nx * dx + ny * dy + nz * dz > 0 ? -length : length;
        nx *= side; ny *= side; nz *= side;
        const float t = p.valid[k] ? p.t[k] : 0.0f;
        p.x[k] = s.eye[0] + t * dx + s.offset * nx; p.y[k] = s.eye[1] + t * dy + s.offset * ny; p.z[k] = s.eye[2] + t * dz + s.offset * nz;
        const float facing = nx * (s.light[0] - p.x[k]) + ny * (s.light[1] - p.y[k]) + nz * (s.light[2] - p.z[k]);
        p.valid[k] = p.valid[k] & (facing > 0 ? -1 : 0);
    }
}

static void shadow_rays(const Scene &s, const Points &p, bool from_light, RTCRay16 &r) {
    for (int k = 0; k < N; k++) {
        const float dx = s.light[0] - p.x[k], dy = s.light[1] - p.y[k], dz = s.light[2] - p.z[k];
        r.org_x[k] = from_light ? s.light[0] : p.x[k]; r.org_y[k] = from_light ? s.light[1] : p.y[k]; r.org_z[k] = from_light ? s.light[2] : p.z[k];
        r.dir_x[k] = from_light ? -dx : dx; r.dir_y[k] = from_light ? -dy : dy; r.dir_z[k] = from_light ? -dz : dz;
        r.tnear[k] = 0; r.tfar[k] = 1; r.time[k] = 0; r.mask[k] = ~0u; r.flags[k] = 0; r.id[k] = k;
    }
}

// What a picture keeps of each packet, 16 pixels side by side.
struct alignas(64) Kept { float t[N], nx[N], ny[N], nz[N]; };

class Picture {
    const Scene &scene;
    const Tracer &tracer;
    Threads &threads;
    int width = 0, height = 0, columns = 0;
    std::vector<Kept> kept;

    void tiles(const std::function<void(int, int, int)> &packet) {
        const int across = (width + TILE - 1) / TILE, down = (height + TILE - 1) / TILE;
        threads.run(across * down, [&](int tile) {
            const int x0 = tile % across * TILE, y0 = tile / across * TILE;
            for (int y = y0; y < std::min(y0 + TILE, height); y += SIDE)
                for (int x = x0; x < std::min(x0 + TILE, width); x += SIDE) packet(x, y, y / SIDE * columns + x / SIDE);
        });
    }
    bool find(int x, int y, RTCRayHit16 &r, int *valid) const {
        camera_rays(scene, x, y, width, height, r, valid);
        tracer.intersect(valid, &r);
        int any = 0;
        for (int k = 0; k < N; k++) any |= valid[k] & (r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID ? -1 : 0);
        return any != 0;
    }
    void block(const RTCRayHit16 &camera, Points &points, bool from_light, uint8_t *out) const {
        alignas(64) RTCRay16 r;
        to_points(scene, camera, points);
        shadow_rays(scene, points, from_light, r);
        int any = 0;
        for (int k = 0; k < N; k++) any |= points.valid[k];
        if (any) tracer.occluded(points.valid, &r);
        for (int k = 0; k < N; k++) out[k] |= uint8_t(points.valid[k] ? (ASKED | (r.tfar[k] < 0 ? 0 : LIT)) : 0);
    }
public:
    std::vector<uint8_t> seen;

    Picture(const Scene &s, const Tracer &t, Threads &p) : scene(s), tracer(t), threads(p) {}
    void resize(int w, int h) {
        if (w == width && h == height) return;
        width = w; height = h; columns = (w + SIDE - 1) / SIDE;
        const size_t packets = size_t(columns) * ((h + SIDE - 1) / SIDE);
        kept.assign(packets, Kept{});
        seen.assign(packets * N, 0);
        primary();
    }
    void primary() {
        tiles([&](int x, int y, int at) {
            alignas(64) RTCRayHit16 r;
            alignas(64) int valid[N];
            find(x, y, r, valid);
            Kept &out = kept[at];
            for (int k = 0; k < N; k++) {
                const bool hit = valid[k] && r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
                out.t[k] = hit ? r.ray.tfar[k] : FAR; out.nx[k] = r.hit.Ng_x[k]; out.ny[k] = r.hit.Ng_y[k]; out.nz[k] = r.hit.Ng_z[k];
            }
        });
    }
    void shadow(bool from_light) {
        tiles([&](int x, int y, int at) {
            alignas(64) RTCRayHit16 camera;
            alignas(64) int valid[N];
            Points points;
            camera_rays(scene, x, y, width, height, camera, valid);
            const Kept &in = kept[at];
            for (int k = 0; k < N; k++) {
                points.t[k] = in.t[k]; points.nx[k] = in.nx[k]; points.ny[k] = in.ny[k]; points.nz[k] = in.nz[k];
                points.valid[k] = in.t[k] < FAR ? -1 : 0;
                seen[size_t(at) * N + k] = points.valid[k] ? HIT : 0;
            }
            block(camera, points, from_light, &seen[size_t(at) * N]);
        });
    }
    void picture() {
        tiles([&](int x, int y, int at) {
            alignas(64) RTCRayHit16 r;
            alignas(64) int valid[N];
            uint8_t *out = &seen[size_t(at) * N];
            const bool any = find(x, y, r, valid);
            Points points;
            for (int k = 0; k < N; k++) {
                points.valid[k] = valid[k] && r.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID ? -1 : 0;
                points.t[k] = r.ray.tfar[k]; points.nx[k] = r.hit.Ng_x[k]; points.ny[k] = r.hit.Ng_y[k]; points.nz[k] = r.hit.Ng_z[k];
                out[k] = points.valid[k] ? HIT : 0;
            }
            if (any) block(r, points, false, out);
        });
    }
};

struct alignas(64) Given { float numbers[6][N]; };

static void general(const Tracer &tracer, Threads &threads, const std::vector<Given> &rays, bool trace, std::vector<float> &distances) {
    constexpr int share = TILE * TILE / N;
    threads.run(int((rays.size() + share - 1) / share), [&](int part) {
        for (size_t at = size_t(part) * share; at < std::min(rays.size(), size_t(part + 1) * share); at++) {
            alignas(64) RTCRayHit16 r;
            alignas(64) int valid[N];
            begin_hits(r);
            const Given &g = rays[at];
            for (int k = 0; k < N; k++) {
                valid[k] = -1;
                r.ray.org_x[k] = g.numbers[0][k]; r.ray.org_y[k] = g.numbers[1][k]; r.ray.org_z[k] = g.numbers[2][k];
                r.ray.dir_x[k] = g.numbers[3][k]; r.ray.dir_y[k] = g.numbers[4][k]; r.ray.dir_z[k] = g.numbers[5][k];
            }
            if (trace) tracer.intersect(valid, &r);
            // Without it, a number of every ray all the same, lest the compiler leave out to read them.
            for (int k = 0; k < N; k++) distances[at * N + k] = trace ? r.ray.tfar[k] : r.ray.org_x[k] + r.ray.dir_z[k];
        }
    });
}

static std::vector<Given> read_rays(const std::string &path) {
    std::ifstream in(path, std::ios::binary | std::ios::ate);
    std::vector<Given> rays(size_t(in.tellg()) / sizeof(Given));
    in.seekg(0);
    in.read(reinterpret_cast<char *>(rays.data()), std::streamsize(rays.size() * sizeof(Given)));
    return rays;
}

template <class Run> static void timed(Run run) {
    const std::clock_t cpu = std::clock();
    const auto start = std::chrono::steady_clock::now();
    run();
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    std::cout << wall.count() << " " << double(std::clock() - cpu) / CLOCKS_PER_SEC << std::endl;
}

int main(int count, char **words) {
    if (count != 3) { std::cerr << "usage: driver THREADS SCENE\n"; return 2; }
    Threads threads(std::stoi(words[1]));
    const Scene scene = read_scene(words[2]);
    Tracer tracer(scene, std::stoi(words[1]));
    Picture picture(scene, tracer, threads);
    std::vector<Given> rays;
    std::vector<float> distances;
    std::cout << tracer.version() << std::endl;
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream in(line);
        std::string what, file;
        int width = 0, height = 0;
        in >> what;
        if (what == "load") {
            in >> file;
            rays = read_rays(file);
            distances.assign(rays.size() * N, 0);
            std::cout << rays.size() * N << std::endl;
            continue;
        }
        if (what == "primary" || what == "shadow" || what == "light" || what == "picture") { in >> width >> height; picture.resize(width, height); }
        if (what == "build") timed([&] { tracer.build(); });
        else if (what == "primary") timed([&] { picture.primary(); });
        else if (what == "shadow") timed([&] { picture.shadow(false); });
        else if (what == "light") timed([&] { picture.shadow(true); });
        else if (what == "picture") timed([&] { picture.picture(); });
        else if (what == "general") timed([&] { general(tracer, threads, rays, true, distances); });
        else if (what == "copy") timed([&] { general(tracer, threads, rays, false, distances); });
        else if (what == "hits") {
            size_t hits = 0, asked = 0, blocked = 0, found = 0;
            for (uint8_t s : picture.seen) { hits += (s & HIT) != 0; asked += (s & ASKED) != 0; blocked += (s & (ASKED | LIT)) == ASKED; }
            for (float t : distances) found += t < FAR;
            std::cout << hits << " " << asked << " " << blocked << " " << found << std::endl;
        } else { std::cerr << "no such run: " << line << "\n"; return 2; }
    }
    return 0;
}
