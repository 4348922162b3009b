/* The smallest engine that meniscus fits into, in C: its own instance, device, memory and frames in flight; an orbiting camera; a
 * frame recorded while the last one runs; an opaque scene of its own (boards.h) and its own sky, over and through which the liquid
 * is drawn. It draws what examples/embed.rs draws, and writes the last picture as a PPM:
 *
 *     capi/install.sh --prefix DIR
 *     export PKG_CONFIG_PATH=DIR/lib/pkgconfig
 *     cc capi/examples/engine.c $(pkg-config --cflags --libs meniscus) -lvulkan -lm -o engine
 *     LD_LIBRARY_PATH=DIR/lib ./engine water.ppm [part of a driver's name] [--validate]
 */
#include <meniscus.h>

#include "boards.h"
#include "headless.h"

enum { IN_FLIGHT = 2, FRAMES = 6, LATTICE = 25, MOST = LATTICE * LATTICE * LATTICE + 1 };
#define RADIUS 0.02f
/* Encodes what is blitted into it, or drawn, as sRGB. */
#define PICTURE VK_FORMAT_R8G8B8A8_SRGB
#define SCENE VK_FORMAT_R16G16B16A16_SFLOAT
#define DEPTH VK_FORMAT_D32_SFLOAT

/* A frame in flight of this engine. */
typedef struct {
    VkCommandBuffer cmd;
    VkFence done;
    Image picture, scene, depth;
    Buffer readback;
} Slot;

/* Ends the program with what meniscus has to say, where it has not done what it was asked for. */
static void check(MeniscusStatus status) {
    if (status != MENISCUS_STATUS_OK) {
        char text[512];
        meniscus_last_message(text, sizeof text);
        fprintf(stderr, "%s: %s\n", meniscus_status_name(status), text);
        exit(1);
    }
}

static VkFence make_fence(const Vulkan *vk) {
    const VkFenceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO, .flags = VK_FENCE_CREATE_SIGNALED_BIT};
    VkFence fence;
    VK(vkCreateFence(vk->device, &info, NULL, &fence));
    return fence;
}

/* A ball of liquid, and a droplet beside it. */
static size_t liquid(float (*at)[3]) {
    size_t count = 0;
    for (int i = 0; i < MOST - 1; i++) {
        const int x = i / (LATTICE * LATTICE), y = i / LATTICE % LATTICE, z = i % LATTICE, middle = LATTICE / 2;
        const float p[3] = {2.0f * RADIUS * (float)(x - middle), 2.0f * RADIUS * (float)(y - middle),
                            2.0f * RADIUS * (float)(z - middle)};
        if (length(p) < 24.0f * RADIUS) {
            memcpy(at[count++], p, sizeof p);
        }
    }
    const float droplet[3] = {0.7f, 0.1f, 0.0f};
    memcpy(at[count++], droplet, sizeof droplet);
    return count;
}

/* The particles, prepared here and given to the renderer. */
static void give_particles(MeniscusRenderer *renderer, const MeniscusSettings *settings) {
    static float positions[MOST][3];
    const size_t count = liquid(positions);
    const MeniscusParticles particles = {
        .struct_size = sizeof particles, .positions = positions[0], .count = count, .radius = RADIUS};
    MeniscusPrepared *prepared;
    check(meniscus_prepare(&particles, settings, &prepared));
    check(meniscus_renderer_set_prepared(renderer, prepared));
    MeniscusReport report = {.struct_size = sizeof report};
    check(meniscus_prepared_report(prepared, &report));
    printf("%u particles: %u splash, %u body\n", (unsigned)count, (unsigned)report.splash, (unsigned)report.body);
    check(meniscus_prepared_destroy(prepared));
}

/* The engine's own renderer: boards into colour and depth, and the colour into the picture. Leaves the picture to be drawn over, and
 * the scene to be read. */
static void draw_scene(const Slot *s, const MeniscusCamera *camera, const float eye[3]) {
    static Board boards[BOARDS];
    wall_and_post(boards, eye);
    const VkImageLayout drawn = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, source = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    const VkImageLayout read = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL, target = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
    const VkImageLayout depth_layout = VK_IMAGE_LAYOUT_DEPTH_ATTACHMENT_OPTIMAL, none = VK_IMAGE_LAYOUT_UNDEFINED;
    const VkRenderingAttachmentInfo color = {.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
                                             .imageView = s->scene.view,
                                             .imageLayout = drawn,
                                             .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
                                             .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
                                             .clearValue = {.color = {.float32 = {0.25f, 0.42f, 0.75f, 0.0f}}}};
    const VkRenderingAttachmentInfo depth = {.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
                                             .imageView = s->depth.view,
                                             .imageLayout = depth_layout,
                                             .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
                                             .storeOp = VK_ATTACHMENT_STORE_OP_STORE,
                                             .clearValue = {.depthStencil = {1.0f, 0}}};
    const VkRenderingInfo info = {.sType = VK_STRUCTURE_TYPE_RENDERING_INFO,
                                  .renderArea = {{0, 0}, {WIDTH, HEIGHT}},
                                  .layerCount = 1,
                                  .colorAttachmentCount = 1,
                                  .pColorAttachments = &color,
                                  .pDepthAttachment = &depth};
    layout(s->cmd, &s->scene, none, drawn);
    layout(s->cmd, &s->depth, none, depth_layout);
    vkCmdBeginRendering(s->cmd, &info);
    for (int i = 0; i < BOARDS; i++) {
        /* A rectangle of one depth can be cleared, so this engine needs no pipeline. */
        VkClearRect rect = {.layerCount = 1};
        float z;
        if (!project(&boards[i], camera->view, camera->projection, camera->near_distance, &rect.rect, &z)) {
            continue;
        }
        VkClearAttachment values[2] = {{.aspectMask = VK_IMAGE_ASPECT_COLOR_BIT}, {.aspectMask = VK_IMAGE_ASPECT_DEPTH_BIT}};
        memcpy(values[0].clearValue.color.float32, boards[i].color, sizeof boards[i].color);
        values[1].clearValue.depthStencil.depth = z;
        vkCmdClearAttachments(s->cmd, 2, values, 1, &rect);
    }
    vkCmdEndRendering(s->cmd);
    layout(s->cmd, &s->scene, drawn, source);
    layout(s->cmd, &s->picture, none, target);
    const VkImageSubresourceLayers layers = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    const VkImageBlit blit = {layers, {{0, 0, 0}, {WIDTH, HEIGHT, 1}}, layers, {{0, 0, 0}, {WIDTH, HEIGHT, 1}}};
    vkCmdBlitImage(s->cmd, s->scene.image, source, s->picture.image, target, 1, &blit, VK_FILTER_NEAREST);
    layout(s->cmd, &s->picture, target, drawn);
    layout(s->cmd, &s->scene, source, read);
    layout(s->cmd, &s->depth, depth_layout, read);
}

/* Copies the picture to where the host can read it. */
static void read_back(const Slot *s) {
    const VkImageLayout source = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    layout(s->cmd, &s->picture, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, source);
    const VkBufferImageCopy copy = {.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1}, .imageExtent = {WIDTH, HEIGHT, 1}};
    vkCmdCopyImageToBuffer(s->cmd, s->picture.image, source, s->readback.buffer, 1, &copy);
    const VkMemoryBarrier2 visible = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                                      .srcStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                      .srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT,
                                      .dstStageMask = VK_PIPELINE_STAGE_2_HOST_BIT,
                                      .dstAccessMask = VK_ACCESS_2_HOST_READ_BIT};
    const VkDependencyInfo info = {
        .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .memoryBarrierCount = 1, .pMemoryBarriers = &visible};
    vkCmdPipelineBarrier2(s->cmd, &info);
}

/* One frame of the engine: waits for this slot's last one, records, submits. Only the engine waits. */
static void frame(const Vulkan *vk, const Slot *s, MeniscusRenderer *renderer, const MeniscusSettings *settings, int number) {
    VK(vkWaitForFences(vk->device, 1, &s->done, VK_TRUE, UINT64_MAX));
    VK(vkResetFences(vk->device, 1, &s->done));
    const VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    VK(vkBeginCommandBuffer(s->cmd, &begin));
    if (number == 0) {
        check(meniscus_renderer_set_procedural_sky(renderer, s->cmd));
    }
    const float angle = 0.3f * (float)number, aspect = (float)WIDTH / (float)HEIGHT;
    const float eye[3] = {2.2f * sinf(angle), 0.6f, 2.2f * cosf(angle)}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    MeniscusCamera camera = {.struct_size = sizeof camera};
    check(meniscus_camera_look_at(&camera, eye, target, up, 0.7f, aspect, 0.1f));
    draw_scene(s, &camera, eye);
    /* Then the liquid, over the picture of the scene and through it. */
    const MeniscusScene scene = {.struct_size = sizeof scene,
                                 .color = s->scene.view,
                                 .depth = s->depth.view,
                                 .color_layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
                                 .depth_layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL,
                                 .cleared_depth = 1.0f};
    const MeniscusFrame input = {.struct_size = sizeof input,
                                 .camera = &camera,
                                 .settings = settings,
                                 .output = s->picture.view,
                                 .slot = (uint32_t)(number % IN_FLIGHT),
                                 .background = MENISCUS_BACKGROUND_HOST,
                                 .scene = &scene};
    check(meniscus_renderer_record(renderer, s->cmd, &input));
    read_back(s);
    VK(vkEndCommandBuffer(s->cmd));
    const VkSubmitInfo submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1, .pCommandBuffers = &s->cmd};
    VK(vkQueueSubmit(vk->queue, 1, &submit, s->done));
}

/* What the renderer has to tell of itself. */
static void tell(MeniscusRenderer *renderer, uint32_t slot) {
    static MeniscusMemory memory[256];
    static MeniscusPassTime passes[256];
    size_t count = 256;
    uint64_t bytes = 0;
    check(meniscus_renderer_memory(renderer, memory, sizeof memory[0], &count));
    for (size_t i = 0; i < count && i < 256; i++) {
        bytes += memory[i].bytes;
    }
    printf("memory: %u resources, %.1f MB\n", (unsigned)count, (double)bytes * 1e-6);
    double ms;
    count = 256;
    if (meniscus_renderer_times(renderer, slot, &ms, passes, sizeof passes[0], &count) == MENISCUS_STATUS_OK && count > 0) {
        printf("last frame: %.2f ms, %u passes from \"%s\" to \"%s\"\n", ms, (unsigned)count, passes[0].name,
               passes[(count < 256 ? count : 256) - 1].name);
    }
}

static void write_ppm(const char *file, const unsigned char *pixels) {
    FILE *f = fopen(file, "wb");
    if (!f) {
        perror(file);
        exit(1);
    }
    fprintf(f, "P6 %d %d 255\n", WIDTH, HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        fwrite(pixels + 4 * i, 1, 3, f);
    }
    if (fclose(f) != 0) {
        perror(file);
        exit(1);
    }
}

int main(int argc, char **argv) {
    const char *file = argc > 1 ? argv[1] : "water.ppm", *driver = argc > 2 ? argv[2] : "";
    Vulkan vk = {.validate = argc > 3 && strcmp(argv[3], "--validate") == 0};
    make_instance(&vk);
    pick_device(&vk, driver);
    check(meniscus_check_device(vkGetInstanceProcAddr, vk.instance, vk.physical, FAMILY));
    /* The engine's device, with what meniscus asks for enabled. */
    VkPhysicalDeviceVulkan13Features features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    check(meniscus_required_features(&features));
    make_device(&vk, &features);
    Slot slots[IN_FLIGHT];
    const VkImageUsageFlags copied = VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    const VkImageUsageFlags attachment = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT, sampled = VK_IMAGE_USAGE_SAMPLED_BIT;
    for (int i = 0; i < IN_FLIGHT; i++) {
        slots[i].cmd = make_commands(&vk);
        slots[i].done = make_fence(&vk);
        slots[i].picture = make_image(&vk, PICTURE, VK_IMAGE_ASPECT_COLOR_BIT, attachment | copied);
        slots[i].scene = make_image(&vk, SCENE, VK_IMAGE_ASPECT_COLOR_BIT, attachment | sampled | copied);
        slots[i].depth =
            make_image(&vk, DEPTH, VK_IMAGE_ASPECT_DEPTH_BIT, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | sampled);
        slots[i].readback = make_buffer(&vk, 4 * WIDTH * HEIGHT, VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    }

    /* meniscus borrows all that. An sRGB output receives linear colour, and encodes it. */
    const MeniscusHost host = {.struct_size = sizeof host,
                               .get_instance_proc_addr = vkGetInstanceProcAddr,
                               .instance = vk.instance,
                               .physical_device = vk.physical,
                               .device = vk.device,
                               .queue_family = FAMILY,
                               .frames_in_flight = IN_FLIGHT,
                               .large_points = vk.large_points,
                               .debug_utils = vk.validate};
    MeniscusRenderer *renderer;
    check(meniscus_renderer_create(&host, PICTURE, &renderer));
    check(meniscus_renderer_resize(renderer, WIDTH, HEIGHT));
    MeniscusSettings *settings;
    check(meniscus_settings_create(&settings));
    check(meniscus_settings_set(settings, "absorption", "0.9,0.3,0.15"));
    give_particles(renderer, settings);
    /* At loading time: frames with these settings compile nothing. */
    check(meniscus_renderer_warm_up(renderer, settings, NULL));
    for (int i = 0; i < FRAMES; i++) {
        frame(&vk, &slots[i % IN_FLIGHT], renderer, settings, i);
    }
    VK(vkDeviceWaitIdle(vk.device));
    write_ppm(file, slots[(FRAMES - 1) % IN_FLIGHT].readback.bytes);
    tell(renderer, (FRAMES - 1) % IN_FLIGHT);

    check(meniscus_renderer_destroy(renderer));
    check(meniscus_settings_destroy(settings));
    for (int i = 0; i < IN_FLIGHT; i++) {
        destroy_image(&vk, &slots[i].picture);
        destroy_image(&vk, &slots[i].scene);
        destroy_image(&vk, &slots[i].depth);
        destroy_buffer(&vk, &slots[i].readback);
        vkDestroyFence(vk.device, slots[i].done, NULL);
    }
    return destroy_vulkan(&vk);
}
