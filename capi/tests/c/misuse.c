/* Calls that cannot be right, each with the status and the words that it has to get; and, between them, that what is right still
 * works, of positions on the device too.
 *
 *     misuse PART-OF-A-DRIVER'S-NAME
 */
#include <math.h>
#include "checks.h"

static void names(MeniscusSettings *settings) {
    char text[16];
    size_t length, count;
    ARGUMENT(meniscus_settings_create(NULL), "null");
    ARGUMENT(meniscus_settings_preset(NULL, "field"), "settings is null");
    ARGUMENT(meniscus_settings_preset(settings, NULL), "preset's name is null");
    ARGUMENT(meniscus_settings_preset(settings, "\xff"), "not UTF-8");
    PARAMETER(meniscus_settings_preset(settings, "nobody24"), "preset is nobody24: there are field, imai16");
    PARAMETER(meniscus_settings_choose(settings, "colours", "red"), "there are layers, smooth and optics");
    PARAMETER(meniscus_settings_choose(settings, "layers", "cake"), "layers has ");
    PARAMETER(meniscus_settings_set(settings, "iorr", "1.4"), "parameter is iorr: there are ");
    PARAMETER(meniscus_settings_set(settings, "ior", "much"), "ior is much: use ");
    PARAMETER(meniscus_settings_enlarge(settings, 0), "0 times");
    OK(meniscus_settings_set(settings, "ior", "0.5"));
    PARAMETER(meniscus_settings_validate(settings), "ior is 0.5");
    OK(meniscus_settings_set(settings, "ior", "1.333"));
    OK(meniscus_settings_set(settings, "smoothing", "7"));
    PARAMETER(meniscus_settings_validate(settings), "smoothing is 7");
    OK(meniscus_settings_set(settings, "smoothing", "0.9"));
    OK(meniscus_settings_validate(settings));
    /* Text is told in parts, and its length whole. */
    OK(meniscus_settings_preset(settings, "imai16"));
    OK(meniscus_settings_member(settings, "smooth", text, 6, &length));
    TRUE(strcmp(text, "plane") == 0 && length == 9);
    OK(meniscus_settings_preset(settings, "field"));
    OK(meniscus_settings_get(settings, "ior", text, sizeof text, NULL));
    TRUE(strcmp(text, "1.333") == 0);
    ARGUMENT(meniscus_settings_get(settings, "ior", NULL, 4, NULL), "buffer is null");
    PARAMETER(meniscus_settings_get(settings, "iorr", text, sizeof text, NULL), "parameter is iorr");
    OK(meniscus_settings_parameter_count(settings, &count));
    OK(meniscus_settings_parameter(settings, count - 1, MENISCUS_PARAMETER_NAME, text, sizeof text, &length));
    TRUE(length > 0);
    PARAMETER(meniscus_settings_parameter(settings, count, MENISCUS_PARAMETER_NAME, text, sizeof text, &length), "there are ");
    PARAMETER(meniscus_settings_parameter(settings, 0, 99, text, sizeof text, &length), "99");
    OK(meniscus_list(MENISCUS_LIST_PRESETS, 0, text, sizeof text, &length));
    TRUE(strcmp(text, "field") == 0 && length == 5);
    NOT_READY(meniscus_list(MENISCUS_LIST_OPTICS, 1000, text, sizeof text, NULL), "ends before 1000");
    PARAMETER(meniscus_list(9, 0, text, sizeof text, NULL), "no list 9");
    /* A copy is another one. */
    MeniscusSettings *copy;
    OK(meniscus_settings_copy(settings, &copy));
    OK(meniscus_settings_set(copy, "ior", "1.5"));
    OK(meniscus_settings_get(settings, "ior", text, sizeof text, NULL));
    TRUE(strcmp(text, "1.333") == 0);
    OK(meniscus_settings_destroy(copy));
    OK(meniscus_settings_destroy(NULL));
}

static void particles(MeniscusRenderer *renderer, const MeniscusSettings *settings) {
    static float at[PARTICLES][3];
    static unsigned char classes[PARTICLES];
    lattice(at, 0.1f);
    MeniscusParticles given = {.struct_size = sizeof given, .positions = at[0], .count = PARTICLES, .radius = 0.1f};
    MeniscusPrepared *prepared = NULL;
    MeniscusReport report = {.struct_size = sizeof report};
    OK(meniscus_prepare(&given, settings, &prepared));
    OK(meniscus_prepared_report(prepared, &report));
    TRUE(report.splash + report.body == PARTICLES && report.body > 600);
    report.struct_size = 1;
    ARGUMENT(meniscus_prepared_report(prepared, &report), "struct_size of MeniscusReport is 1");
    OK(meniscus_renderer_set_prepared(renderer, prepared));
    ARGUMENT(meniscus_renderer_set_prepared(renderer, NULL), "prepared particles is null");
    OK(meniscus_prepared_destroy(prepared));
    given.radius = 0.0f;
    PARAMETER(meniscus_prepare(&given, settings, &prepared), "particle radius");
    TRUE(prepared == NULL);
    given.radius = 0.1f;
    memset(classes, 7, sizeof classes);
    given.classes = classes;
    PARAMETER(meniscus_prepare(&given, settings, &prepared), "class 7");
    memset(classes, MENISCUS_CLASS_SPLASH, sizeof classes);
    OK(meniscus_prepare(&given, settings, &prepared));
    report.struct_size = sizeof report;
    OK(meniscus_prepared_report(prepared, &report));
    TRUE(report.splash == PARTICLES);
    OK(meniscus_prepared_destroy(prepared));
    /* Fields that an older program does not have are as if they were 0. */
    given.struct_size = offsetof(MeniscusParticles, classes);
    OK(meniscus_prepare(&given, settings, &prepared));
    OK(meniscus_prepared_report(prepared, &report));
    TRUE(report.body > 600);
    OK(meniscus_prepared_destroy(prepared));
    given.struct_size = sizeof given;
    given.classes = NULL;
    given.count = SIZE_MAX / 2;
    ARGUMENT(meniscus_prepare(&given, settings, &prepared), "more than memory holds");
    given.positions = NULL;
    given.count = 1;
    ARGUMENT(meniscus_prepare(&given, settings, &prepared), "positions: null for 1");
    at[5][1] = NAN;
    given.positions = at[0];
    given.count = PARTICLES;
    PARAMETER(meniscus_prepare(&given, settings, &prepared), "particle 5");
    lattice(at, 0.1f);

    float radius = 0.0f, density = 0.0f;
    OK(meniscus_estimate_radius(at[0], PARTICLES, &radius));
    TRUE(fabsf(radius - 0.1f) < 0.02f);
    PARAMETER(meniscus_estimate_radius(at[0], 1, &radius), "distinct");
    OK(meniscus_classify(at[0], PARTICLES, 0.1f, settings, NULL, 0.0f, classes));
    TRUE(classes[PARTICLES / 2] == MENISCUS_CLASS_BODY);
    ARGUMENT(meniscus_classify(at[0], PARTICLES, 0.1f, settings, NULL, 0.0f, NULL), "null");
    MeniscusDensity *field;
    OK(meniscus_density_create(at[0], PARTICLES, 0.1f, settings, &field));
    OK(meniscus_density_at(field, at[PARTICLES / 2], &density));
    TRUE(fabsf(density - 1.0f) < 0.01f);
    ARGUMENT(meniscus_density_at(NULL, at[0], &density), "density is null");
    OK(meniscus_density_destroy(field));

    const MeniscusEllipsoid ball = {.axes = {0.1f, 0, 0, 0, 0.1f, 0, 0, 0, 0.1f}};
    const MeniscusPoint point = {.density = 1.0f, .kind = MENISCUS_CLASS_BODY}, odd = {.density = 1.0f, .kind = 3};
    const float speed = 1.0f;
    OK(meniscus_renderer_set_ellipsoids(renderer, 0.1f, &ball, 1, 0));
    OK(meniscus_renderer_set_points(renderer, &point, 1));
    OK(meniscus_renderer_set_speeds(renderer, &speed, 1));
    PARAMETER(meniscus_renderer_set_points(renderer, &odd, 1), "class 3");
    PARAMETER(meniscus_renderer_set_points(renderer, NULL, 0), "give one for each of 1 particles");
    PARAMETER(meniscus_renderer_set_ellipsoids(renderer, 0.1f, &ball, 1, 2), "splash count is 2");
    ARGUMENT(meniscus_renderer_set_ellipsoids(renderer, 0.1f, NULL, 1, 0), "ellipsoids: null");
    OK(meniscus_renderer_set_ellipsoids(renderer, 0.1f, NULL, 0, 0));
}

static void hosts(const Vulkan *vk, const MeniscusHost *good) {
    const VkFormat format = VK_FORMAT_R8G8B8A8_UNORM;
    MeniscusRenderer *renderer = (MeniscusRenderer *)&checks;
    ARGUMENT(meniscus_renderer_create(NULL, format, &renderer), "MeniscusHost is null");
    TRUE(renderer == NULL);
    ARGUMENT(meniscus_renderer_create(good, format, NULL), "null");
    MeniscusHost host = *good;
    host.struct_size = 0;
    ARGUMENT(meniscus_renderer_create(&host, format, &renderer), "set it to sizeof(MeniscusHost)");
    host = *good, host.get_instance_proc_addr = NULL;
    ARGUMENT(meniscus_renderer_create(&host, format, &renderer), "vkGetInstanceProcAddr is null");
    host = *good, host.instance = VK_NULL_HANDLE;
    PARAMETER(meniscus_renderer_create(&host, format, &renderer), "instance is VK_NULL_HANDLE");
    host = *good, host.physical_device = VK_NULL_HANDLE;
    PARAMETER(meniscus_renderer_create(&host, format, &renderer), "none of the instance's");
    host = *good, host.device = VK_NULL_HANDLE;
    PARAMETER(meniscus_renderer_create(&host, format, &renderer), "device is VK_NULL_HANDLE");
    host = *good, host.queue_family = 99;
    UNSUPPORTED(meniscus_renderer_create(&host, format, &renderer), "queue family");
    host = *good, host.frames_in_flight = 1000;
    PARAMETER(meniscus_renderer_create(&host, format, &renderer), "frames in flight is 1000");
    PARAMETER(meniscus_renderer_create(good, VK_FORMAT_UNDEFINED, &renderer), "output format");
    UNSUPPORTED(meniscus_check_device(vkGetInstanceProcAddr, vk->instance, vk->physical, 99), "queue family");
    ARGUMENT(meniscus_required_features(NULL), "null");
    ARGUMENT(meniscus_renderer_resize(NULL, 1, 1), "renderer is null");
    OK(meniscus_renderer_destroy(NULL));
}

/* The faster of two methods follows when the first takes too long. */
static void choose(MeniscusRenderer *renderer, const MeniscusFrame *frame) {
    const char *names[] = {"imai16", "green10"}, *same[] = {"imai16", "imai16"};
    MeniscusSettings *methods[2];
    MeniscusAuto *chooser = NULL;
    VkBool32 changed = VK_FALSE;
    char why[64], optics[32];
    size_t pick = 9, before = 9, made = 0;
    for (int i = 0; i < 2; i++) {
        OK(meniscus_settings_create(&methods[i]));
        OK(meniscus_settings_preset(methods[i], names[i]));
    }
    const MeniscusSettings *const choices[2] = {methods[0], methods[1]};
    PARAMETER(meniscus_auto_create(0.0, names, choices, 2, &chooser), "budget_ms is 0");
    PARAMETER(meniscus_auto_create(1.0, same, choices, 2, &chooser), "two methods are called imai16");
    PARAMETER(meniscus_auto_create(1.0, NULL, NULL, 0, &chooser), "choices is none");
    ARGUMENT(meniscus_auto_create(1.0, NULL, choices, 2, &chooser), "names: null for 2");
    OK(meniscus_auto_create(1e-6, names, choices, 2, &chooser));
    OK(meniscus_auto_warm_up(chooser, renderer, frame, &made));
    PARAMETER(meniscus_auto_observe(chooser, renderer, 0, 0, NULL, NULL, 0, NULL), "pick is 0");
    OK(meniscus_auto_pick(chooser, &before, NULL));
    NOT_READY(meniscus_auto_observe(chooser, renderer, 7, before, NULL, NULL, 0, NULL), "slot 7");
    for (int i = 0; i < 4; i++) {
        TRUE(!changed);
        OK(meniscus_auto_observe(chooser, renderer, 0, before, &changed, why, sizeof why, NULL));
    }
    TRUE(changed && strstr(why, "imai16 took "));
    OK(meniscus_auto_pick(chooser, &pick, methods[0]));
    OK(meniscus_settings_member(methods[0], "optics", optics, sizeof optics, NULL));
    TRUE(before == 0 && pick == 1 && made > 0 && strcmp(optics, "ssfr") == 0);
    OK(meniscus_auto_destroy(chooser));
    OK(meniscus_settings_destroy(methods[0]));
    OK(meniscus_settings_destroy(methods[1]));
}

/* Draws a frame; what is in the picture. */
static void draw(const Vulkan *vk, VkCommandBuffer cmd, MeniscusRenderer *renderer, const MeniscusFrame *frame, const Image *picture,
                 const Buffer *readback, unsigned char *pixels) {
    const VkImageLayout drawn = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, source = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    const VkBufferImageCopy copy = {.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1}, .imageExtent = {WIDTH, HEIGHT, 1}};
    begin(vk, cmd);
    layout(cmd, picture, VK_IMAGE_LAYOUT_UNDEFINED, drawn);
    OK(meniscus_renderer_record(renderer, cmd, frame));
    layout(cmd, picture, drawn, source);
    vkCmdCopyImageToBuffer(cmd, picture->image, source, readback->buffer, 1, &copy);
    submit(vk, cmd);
    memcpy(pixels, readback->bytes, 4 * WIDTH * HEIGHT);
}

/* An eye between particles on the device: maps have to be told where it is, and the device finds out. */
static void look_around(const Vulkan *vk, VkCommandBuffer cmd, MeniscusRenderer *renderer, MeniscusFrame frame, const Image *picture,
                        const Buffer *readback) {
    static unsigned char pictures[3][4 * WIDTH * HEIGHT];
    const float eye[3] = {0.1f, 0.1f, 0.1f}, target[3] = {1, 0.5f, -2}, up[3] = {0, 1, 0};
    MeniscusCamera camera = {.struct_size = sizeof camera};
    OK(meniscus_camera_look_at(&camera, eye, target, up, 0.7f, (float)WIDTH / HEIGHT, 0.005f));
    MeniscusSettings *maps;
    OK(meniscus_settings_create(&maps));
    OK(meniscus_settings_preset(maps, "imai16"));
    frame.camera = &camera, frame.settings = maps;
    const uint32_t said[3] = {MENISCUS_EYE_OUTSIDE, MENISCUS_EYE_INSIDE, MENISCUS_EYE_ON_DEVICE};
    for (int i = 0; i < 3; i++) {
        frame.eye_inside = said[i];
        draw(vk, cmd, renderer, &frame, picture, readback, pictures[i]);
    }
    TRUE(memcmp(pictures[0], pictures[1], sizeof pictures[0]) != 0);
    TRUE(memcmp(pictures[1], pictures[2], sizeof pictures[0]) == 0);
    OK(meniscus_settings_destroy(maps));
}

static void frames(const Vulkan *vk, MeniscusRenderer *renderer, const MeniscusSettings *settings) {
    const float eye[3] = {0.5f, 1.0f, 4.0f}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    const float map[2][3] = {{0.2f, 0.4f, 0.9f}, {0.9f, 0.5f, 0.1f}};
    const VkCommandBuffer cmd = make_commands(vk);
    const Image picture = make_image(vk, VK_FORMAT_R8G8B8A8_UNORM, VK_IMAGE_ASPECT_COLOR_BIT,
                                     VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT);
    const Buffer readback = make_buffer(vk, 4 * WIDTH * HEIGHT, VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    MeniscusCamera camera = {.struct_size = sizeof camera};
    OK(meniscus_camera_look_at(&camera, eye, target, up, 0.7f, (float)WIDTH / HEIGHT, 0.1f));
    PARAMETER(meniscus_camera_look_at(&camera, eye, eye, up, 0.7f, 1.0f, 0.1f), "camera view");
    PARAMETER(meniscus_camera_look_at(&camera, eye, target, up, 9.0f, 1.0f, 0.1f), "field of view");
    ARGUMENT(meniscus_camera_look_at(NULL, eye, target, up, 0.7f, 1.0f, 0.1f), "MeniscusCamera is null");
    const MeniscusFrame good = {
        .struct_size = sizeof good, .camera = &camera, .settings = settings, .output = picture.view};
    MeniscusFrame f = good;
    double ms;
    size_t count = 0;
    begin(vk, cmd);
    NOT_READY(meniscus_renderer_times(renderer, 0, &ms, NULL, 0, &count), "slot 0 has no times");
    ORDER(meniscus_renderer_record(renderer, cmd, &good), "no size yet");
    PARAMETER(meniscus_renderer_resize(renderer, 0, 1), "size is 0x1");
    OK(meniscus_renderer_resize(renderer, WIDTH, HEIGHT));
    ORDER(meniscus_renderer_record(renderer, cmd, &good), "no environment yet");
    ARGUMENT(meniscus_renderer_set_environment(renderer, cmd, 2, 1, NULL), "texels of the environment: null for 2");
    ARGUMENT(meniscus_renderer_set_environment(renderer, cmd, UINT32_MAX, UINT32_MAX, map[0]), "more than memory holds");
    PARAMETER(meniscus_renderer_set_environment(renderer, cmd, 0, 1, map[0]), "environment map");
    PARAMETER(meniscus_renderer_set_environment(renderer, NULL, 2, 1, map[0]), "command buffer is null");
    OK(meniscus_renderer_set_environment(renderer, cmd, 2, 1, map[0]));
    submit(vk, cmd);

    begin(vk, cmd);
    ARGUMENT(meniscus_renderer_record(NULL, cmd, &good), "renderer is null");
    ARGUMENT(meniscus_renderer_record(renderer, cmd, NULL), "MeniscusFrame is null");
    PARAMETER(meniscus_renderer_record(renderer, NULL, &good), "command buffer is null");
    f.struct_size = 8;
    ARGUMENT(meniscus_renderer_record(renderer, cmd, &f), "struct_size of MeniscusFrame is 8");
    f = good, f.camera = NULL;
    ARGUMENT(meniscus_renderer_record(renderer, cmd, &f), "MeniscusCamera is null");
    f = good, f.settings = NULL;
    ARGUMENT(meniscus_renderer_record(renderer, cmd, &f), "MeniscusFrame::settings is null");
    f = good, f.output = VK_NULL_HANDLE;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "output is null");
    f = good, f.slot = 5;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "slot is 5");
    f = good, f.background = 7;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "MENISCUS_BACKGROUND_");
    f = good, f.eye_inside = 3;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "MeniscusFrame::eye_inside is 3: use one of MENISCUS_EYE_");
    const MeniscusCamera flat = {.struct_size = sizeof flat};
    f = good, f.camera = &flat;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "camera view");
    MeniscusCamera odd = camera;
    odd.reserved = 1;
    f.camera = &odd;
    ARGUMENT(meniscus_renderer_record(renderer, cmd, &f), "MeniscusCamera asks for what this library");
    MeniscusEnvironment environment = {.struct_size = sizeof environment, .shape = 9};
    f = good, f.environment = &environment;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "MENISCUS_ENVIRONMENT_");
    environment.shape = MENISCUS_ENVIRONMENT_CUBE;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "environment is null");
    const MeniscusScene scene = {.struct_size = sizeof scene, .color = picture.view, .depth = picture.view};
    f = good, f.scene = &scene;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "scene colour is in UNDEFINED");
    MeniscusSurface surface = {.struct_size = sizeof surface, .normal = picture.view, .normal_format = VK_FORMAT_R8G8B8A8_SNORM};
    f = good, f.surface = &surface;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "layout of the surface normal is UNDEFINED");
    surface.normal_layout = VK_IMAGE_LAYOUT_GENERAL;
    surface.depth = picture.view, surface.depth_format = VK_FORMAT_S8_UINT, surface.depth_layout = VK_IMAGE_LAYOUT_GENERAL;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "format of the surface depth is S8_UINT");
    surface.depth = VK_NULL_HANDLE, surface.normal_format = VK_FORMAT_R8G8B8A8_UINT;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "format of the surface normal is R8G8B8A8_UINT");
    MeniscusMotion motion = {.struct_size = sizeof motion, .output = picture.view, .output_format = VK_FORMAT_R8_UNORM, .count = 3};
    surface.normal = VK_NULL_HANDLE, surface.motion = &motion;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "format of the motion vectors is R8_UNORM");
    motion.output_format = VK_FORMAT_R16G16_SFLOAT, motion.output_layout = VK_IMAGE_LAYOUT_GENERAL;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "buffer of moving positions is null");
    motion.struct_size = 9;
    ARGUMENT(meniscus_renderer_record(renderer, cmd, &f), "struct_size of MeniscusMotion is 9");
    surface.motion = NULL, surface.reserved = 4;
    ARGUMENT(meniscus_renderer_record(renderer, cmd, &f), "MeniscusSurface asks for what this library");
    surface.reserved = 0, surface.reactive = picture.view, surface.reactive_format = VK_FORMAT_R8_UINT;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "format of the reactive mask is R8_UINT");
    f = good, f.output_layout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "layout of the output is PRESENT_SRC_KHR");
    f = good, f.origin[1] = 1u << 31;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "origin is [0, 2147483648]");
    MeniscusPositions positions = {.struct_size = sizeof positions, .count = PARTICLES, .radius = 0.1f};
    f = good, f.positions = &positions;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "buffer of positions is null");
    positions.offset = 2;
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "offset of positions is 2");
    positions.struct_size = 3;
    ARGUMENT(meniscus_renderer_record(renderer, cmd, &f), "MeniscusPositions");
    VK(vkEndCommandBuffer(cmd));

    /* Positions on the device: packed; and in a struct, with ids; of a program of a later version. */
    static unsigned char pictures[4][4 * WIDTH * HEIGHT];
    static float at[PARTICLES][3];
    lattice(at, 0.1f);
    const VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    const Buffer packed = make_buffer(vk, sizeof at, storage), strewn = make_buffer(vk, 16 + 32 * PARTICLES, storage);
    memcpy(packed.bytes, at, sizeof at);
    memset(strewn.bytes, 0x7f, 16 + 32 * PARTICLES);
    for (uint32_t i = 0; i < PARTICLES; i++) {
        memcpy((char *)strewn.bytes + 16 + 32 * i, at[i], sizeof at[i]);
        memcpy((char *)strewn.bytes + 16 + 32 * i + 12, &i, sizeof i);
    }
    draw(vk, cmd, renderer, &good, &picture, &readback, pictures[0]);
    positions = (MeniscusPositions){
        .struct_size = sizeof positions, .buffer = packed.buffer, .count = PARTICLES, .radius = 0.1f};
    size_t made = 0;
    OK(meniscus_renderer_warm_up_like(renderer, &f, &made));
    TRUE(made > 0);
    OK(meniscus_renderer_warm_up_like(renderer, &f, &made));
    TRUE(made == 0);
    draw(vk, cmd, renderer, &f, &picture, &readback, pictures[1]);
    positions.buffer = strewn.buffer, positions.offset = 16, positions.stride = 32;
    struct {
        MeniscusFrame known;
        uint64_t more;
    } later = {f, 0};
    later.known.struct_size = sizeof later;
    draw(vk, cmd, renderer, &later.known, &picture, &readback, pictures[2]);
    /* As many as the device says, which is what there may be, or fewer. */
    const uint32_t said[2] = {PARTICLES, 0};
    const Buffer counted = make_buffer(vk, sizeof said, storage);
    memcpy(counted.bytes, said, sizeof said);
    positions.count_buffer = counted.buffer, positions.count_offset = 2;
    begin(vk, cmd);
    PARAMETER(meniscus_renderer_record(renderer, cmd, &f), "offset of the particle count is 2");
    VK(vkEndCommandBuffer(cmd));
    positions.count_offset = 0;
    draw(vk, cmd, renderer, &f, &picture, &readback, pictures[3]);
    TRUE(memcmp(pictures[2], pictures[3], sizeof pictures[0]) == 0);
    positions.count_offset = 4;
    draw(vk, cmd, renderer, &f, &picture, &readback, pictures[3]);
    TRUE(memcmp(pictures[2], pictures[3], sizeof pictures[0]) != 0);
    positions.count_buffer = VK_NULL_HANDLE;
    positions.keep_class_below = 0.55f, positions.id_number = PARTICLES, positions.id_buffer = strewn.buffer;
    positions.id_offset = 28, positions.id_stride = 32;
    draw(vk, cmd, renderer, &f, &picture, &readback, pictures[3]);
    TRUE(memcmp(pictures[0], pictures[1], sizeof pictures[0]) != 0);
    TRUE(memcmp(pictures[1], pictures[2], sizeof pictures[0]) == 0);
    TRUE(memcmp(pictures[0], pictures[3], sizeof pictures[0]) != 0);
    look_around(vk, cmd, renderer, f, &picture, &readback);
    choose(renderer, &f);
    begin(vk, cmd);
    later.more = 1;
    ARGUMENT(meniscus_renderer_record(renderer, cmd, &later.known), "use a newer library");
    VK(vkEndCommandBuffer(cmd));
    OK(meniscus_renderer_abandon(renderer, 0));

    MeniscusMemory entries[2];
    count = 2;
    OK(meniscus_renderer_memory_requirements(renderer, 64, 64, settings, 0, 0, &positions, entries, sizeof entries[0], &count));
    TRUE(count > 2 && entries[1].bytes > 0 && entries[1].name[0] != 0);
    ARGUMENT(meniscus_renderer_memory_requirements(renderer, 64, 64, settings, 0, 0, &positions, entries, 5, &count),
             "sizeof(MeniscusMemory)");
    PARAMETER(meniscus_renderer_memory_requirements(renderer, 64, 64, settings, UINT32_MAX, 1, NULL, NULL, 0, &count), "2^32");
    ARGUMENT(meniscus_renderer_memory(renderer, NULL, 0, NULL), "count is null");
    char line[8];
    size_t length = 0;
    OK(meniscus_renderer_plan(renderer, line, sizeof line, &length));
    TRUE(length > 1000 && strlen(line) == 7);
    destroy_image(vk, &picture);
    destroy_buffer(vk, &readback);
    destroy_buffer(vk, &packed);
    destroy_buffer(vk, &strewn);
    destroy_buffer(vk, &counted);
}

int main(int argc, char **argv) {
    Vulkan vk = {.validate = 1};
    make_instance(&vk);
    pick_device(&vk, argc > 1 ? argv[1] : "");
    VkPhysicalDeviceVulkan13Features features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    OK(meniscus_required_features(&features));
    make_device(&vk, &features);
    const MeniscusHost host = {.struct_size = sizeof host,
                               .get_instance_proc_addr = vkGetInstanceProcAddr,
                               .instance = vk.instance,
                               .physical_device = vk.physical,
                               .device = vk.device,
                               .queue_family = FAMILY,
                               .debug_utils = VK_TRUE};
    hosts(&vk, &host);
    MeniscusSettings *settings;
    OK(meniscus_settings_create(&settings));
    names(settings);
    MeniscusRenderer *renderer;
    OK(meniscus_renderer_create(&host, VK_FORMAT_R8G8B8A8_UNORM, &renderer));
    particles(renderer, settings);
    frames(&vk, renderer, settings);
    OK(meniscus_renderer_destroy(renderer));
    OK(meniscus_settings_destroy(settings));
    printf("%d checks, %d failed\n", checks, failed);
    return destroy_vulkan(&vk) || failed > 0;
}
