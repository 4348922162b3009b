/* Device memory from an allocator of the program's: what is asked for, that all of it comes back, and what is said where there is none.
 *
 *     allocator PART-OF-A-DRIVER'S-NAME
 */
#include "checks.h"

/* The plainest allocator: each piece is an allocation of its own. */
typedef struct {
    const Vulkan *vk;
    int asked, most, alive, odd, forgets;
    int of_location[2];
} Plain;

static VkResult take(void *user_data, const MeniscusMemoryRequest *request, MeniscusAllocation *allocation) {
    Plain *plain = user_data;
    if (plain->asked++ == plain->most) {
        return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    }
    const int upload = request->location == MENISCUS_LOCATION_UPLOAD;
    plain->odd += request->struct_size != sizeof *request || request->size == 0 || request->alignment == 0 || request->reserved != 0 ||
                  request->name[0] == 0 || allocation->memory != VK_NULL_HANDLE || (upload && !request->linear);
    plain->of_location[upload]++;
    const VkMemoryRequirements needed = {request->size, request->alignment, request->memory_type_bits};
    allocation->memory = allocate(plain->vk, needed, upload ? VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT
                                                            : VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    if (upload && !plain->forgets) {
        VK(vkMapMemory(plain->vk->device, allocation->memory, 0, VK_WHOLE_SIZE, 0, &allocation->mapped));
    }
    allocation->own = malloc(1);
    plain->alive++;
    return VK_SUCCESS;
}

static void give_back(void *user_data, const MeniscusAllocation *allocation) {
    Plain *plain = user_data;
    free(allocation->own);
    vkFreeMemory(plain->vk->device, allocation->memory, NULL);
    plain->alive--;
}

/* A frame by a renderer of this host's, which ends with it; what recording it said. */
static MeniscusStatus draw(const Vulkan *vk, const MeniscusHost *host, const MeniscusSettings *settings, const Buffer *at,
                           unsigned char *pixels) {
    const float eye[3] = {0.5f, 1.0f, 4.0f}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    const float map[2][3] = {{0.2f, 0.4f, 0.9f}, {0.9f, 0.5f, 0.1f}};
    const VkCommandBuffer cmd = make_commands(vk);
    const Image picture = make_image(vk, VK_FORMAT_R8G8B8A8_UNORM, VK_IMAGE_ASPECT_COLOR_BIT,
                                     VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT);
    const Buffer readback = make_buffer(vk, 4 * WIDTH * HEIGHT, VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    const VkImageLayout drawn = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, source = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    const VkBufferImageCopy copy = {.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1}, .imageExtent = {WIDTH, HEIGHT, 1}};
    MeniscusCamera camera = {.struct_size = sizeof camera};
    OK(meniscus_camera_look_at(&camera, eye, target, up, 0.7f, (float)WIDTH / HEIGHT, 0.1f));
    const MeniscusPositions positions = {
        .struct_size = sizeof positions, .buffer = at->buffer, .count = PARTICLES, .radius = 0.1f};
    const MeniscusFrame frame = {.struct_size = sizeof frame,
                                 .camera = &camera,
                                 .settings = settings,
                                 .output = picture.view,
                                 .positions = &positions};
    MeniscusRenderer *renderer;
    OK(meniscus_renderer_create(host, VK_FORMAT_R8G8B8A8_UNORM, &renderer));
    OK(meniscus_renderer_resize(renderer, WIDTH, HEIGHT));
    begin(vk, cmd);
    OK(meniscus_renderer_set_environment(renderer, cmd, 2, 1, map[0]));
    layout(cmd, &picture, VK_IMAGE_LAYOUT_UNDEFINED, drawn);
    const MeniscusStatus status = meniscus_renderer_record(renderer, cmd, &frame);
    if (status == MENISCUS_STATUS_OK) {
        layout(cmd, &picture, drawn, source);
        vkCmdCopyImageToBuffer(cmd, picture.image, source, readback.buffer, 1, &copy);
        submit(vk, cmd);
        memcpy(pixels, readback.bytes, 4 * WIDTH * HEIGHT);
    } else {
        VK(vkEndCommandBuffer(cmd));
    }
    OK(meniscus_renderer_destroy(renderer));
    destroy_image(vk, &picture);
    destroy_buffer(vk, &readback);
    return status;
}

int main(int argc, char **argv) {
    static unsigned char pictures[2][4 * WIDTH * HEIGHT];
    Vulkan vk = {.validate = 1};
    make_instance(&vk);
    pick_device(&vk, argc > 1 ? argv[1] : "");
    VkPhysicalDeviceVulkan13Features features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    OK(meniscus_required_features(&features));
    make_device(&vk, &features);
    MeniscusHost host = {.struct_size = sizeof host,
                         .get_instance_proc_addr = vkGetInstanceProcAddr,
                         .instance = vk.instance,
                         .physical_device = vk.physical,
                         .device = vk.device,
                         .queue_family = FAMILY,
                         .debug_utils = VK_TRUE};
    MeniscusSettings *settings;
    OK(meniscus_settings_create(&settings));
    const Buffer at = make_buffer(&vk, 12 * PARTICLES, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
    lattice((float(*)[3])at.bytes, 0.1f);

    /* The same picture as with the renderer's own, and all of it comes back. */
    OK(draw(&vk, &host, settings, &at, pictures[0]));
    Plain plain = {.vk = &vk, .most = -1};
    MeniscusAllocator allocator = {.struct_size = sizeof allocator, .user_data = &plain, .allocate = take, .free = give_back};
    host.allocator = &allocator;
    OK(draw(&vk, &host, settings, &at, pictures[1]));
    TRUE(memcmp(pictures[0], pictures[1], sizeof pictures[0]) == 0);
    const int asked = plain.asked;
    TRUE(asked > 10 && plain.alive == 0 && plain.odd == 0);
    TRUE(plain.of_location[0] > 5 && plain.of_location[1] > 0);

    /* Where there is no more, at the first time and in the frame, that is said, and what there was comes back. */
    MeniscusRenderer *renderer;
    plain = (Plain){.vk = &vk, .most = 0};
    MEMORY(meniscus_renderer_create(&host, VK_FORMAT_R8G8B8A8_UNORM, &renderer), "bytes of device memory");
    TRUE(renderer == NULL && plain.asked == 1 && plain.alive == 0);
    plain = (Plain){.vk = &vk, .most = asked - 1};
    TRUE(draw(&vk, &host, settings, &at, pictures[1]) == MENISCUS_STATUS_ERROR_MEMORY);
    TRUE(plain.asked == asked && plain.alive == 0);
    plain = (Plain){.vk = &vk, .most = -1, .forgets = 1};
    MEMORY(meniscus_renderer_create(&host, VK_FORMAT_R8G8B8A8_UNORM, &renderer), "not mapped");
    TRUE(plain.alive == 0);

    /* What is no allocator. */
    allocator.free = NULL;
    ARGUMENT(meniscus_renderer_create(&host, VK_FORMAT_R8G8B8A8_UNORM, &renderer), "MeniscusAllocator::free is null");
    allocator.allocate = NULL;
    ARGUMENT(meniscus_renderer_create(&host, VK_FORMAT_R8G8B8A8_UNORM, &renderer), "MeniscusAllocator::allocate is null");
    allocator.struct_size = 8;
    ARGUMENT(meniscus_renderer_create(&host, VK_FORMAT_R8G8B8A8_UNORM, &renderer), "struct_size of MeniscusAllocator is 8");

    destroy_buffer(&vk, &at);
    OK(meniscus_settings_destroy(settings));
    printf("%d checks, %d failed; asked %d times\n", checks, failed, asked);
    return destroy_vulkan(&vk) || failed > 0;
}
