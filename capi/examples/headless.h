/* The engine's own Vulkan, without a window: instance, device, images, a buffer to read back. Programs end where something fails. */
#ifndef HEADLESS_H
#define HEADLESS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vulkan.h>

/* Graphics and compute, on every driver that these examples are for. */
#define FAMILY 0

#define VK(call)                                                 \
    do {                                                         \
        const VkResult vk_result = (call);                       \
        if (vk_result != VK_SUCCESS) {                           \
            fprintf(stderr, #call ": VkResult %d\n", vk_result); \
            exit(1);                                             \
        }                                                        \
    } while (0)

typedef struct {
    int validate, messages;
    VkInstance instance;
    VkDebugUtilsMessengerEXT messenger;
    VkPhysicalDevice physical;
    VkBool32 large_points;
    VkDevice device;
    VkQueue queue;
    VkCommandPool pool;
} Vulkan;

typedef struct {
    VkImage image;
    VkImageView view;
    VkDeviceMemory memory;
    VkImageAspectFlags aspect;
} Image;

typedef struct {
    VkBuffer buffer;
    VkDeviceMemory memory;
    void *bytes;
} Buffer;

static VKAPI_ATTR VkBool32 VKAPI_CALL said(VkDebugUtilsMessageSeverityFlagBitsEXT severity, VkDebugUtilsMessageTypeFlagsEXT kind,
                                           const VkDebugUtilsMessengerCallbackDataEXT *data, void *vulkan) {
    (void)severity, (void)kind;
    fprintf(stderr, "validation: %s\n", data->pMessage);
    ((Vulkan *)vulkan)->messages++;
    return VK_FALSE;
}

/* With `validate` every message of the validation layer, with synchronization, is printed and counted. */
static void make_instance(Vulkan *vk) {
    const char *layers[] = {"VK_LAYER_KHRONOS_validation"};
    const char *extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
    const VkApplicationInfo application = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_3};
    const VkValidationFeatureEnableEXT synchronization[] = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    const VkValidationFeaturesEXT validation = {.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT,
                                                .enabledValidationFeatureCount = 1,
                                                .pEnabledValidationFeatures = synchronization};
    const VkDebugUtilsMessengerCreateInfoEXT messenger = {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .pNext = &validation,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT,
        .pfnUserCallback = said,
        .pUserData = vk};
    const VkInstanceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                                       .pNext = vk->validate ? &messenger : NULL,
                                       .pApplicationInfo = &application,
                                       .enabledLayerCount = vk->validate ? 1 : 0,
                                       .ppEnabledLayerNames = layers,
                                       .enabledExtensionCount = vk->validate ? 2 : 0,
                                       .ppEnabledExtensionNames = extensions};
    VK(vkCreateInstance(&info, NULL, &vk->instance));
    if (vk->validate) {
        VkDebugUtilsMessengerCreateInfoEXT alone = messenger;
        alone.pNext = NULL;
        const PFN_vkVoidFunction make = vkGetInstanceProcAddr(vk->instance, "vkCreateDebugUtilsMessengerEXT");
        VK(((PFN_vkCreateDebugUtilsMessengerEXT)make)(vk->instance, &alone, NULL, &vk->messenger));
    }
}

/* The first device whose driver's name or version has this part. */
static void pick_device(Vulkan *vk, const char *part) {
    VkPhysicalDevice all[16];
    uint32_t count = 16;
    const VkResult result = vkEnumeratePhysicalDevices(vk->instance, &count, all);
    for (uint32_t i = 0; (result == VK_SUCCESS || result == VK_INCOMPLETE) && i < count; i++) {
        VkPhysicalDeviceDriverProperties driver = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
        VkPhysicalDeviceProperties2 properties = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &driver};
        vkGetPhysicalDeviceProperties2(all[i], &properties);
        char name[VK_MAX_DRIVER_NAME_SIZE + VK_MAX_DRIVER_INFO_SIZE + 2];
        snprintf(name, sizeof name, "%s %s", driver.driverName, driver.driverInfo);
        if (properties.properties.apiVersion >= VK_API_VERSION_1_3 && strstr(name, part)) {
            printf("device: %s, %s\n", properties.properties.deviceName, name);
            vk->physical = all[i];
            return;
        }
    }
    fprintf(stderr, "no Vulkan 1.3 device whose driver is called \"%s\"\n", part);
    exit(1);
}

/* A device with one queue. */
static void make_device(Vulkan *vk, void *features_to_enable) {
    VkPhysicalDeviceFeatures has, features = {0};
    vkGetPhysicalDeviceFeatures(vk->physical, &has);
    features.largePoints = vk->large_points = has.largePoints;
    const float priority = 1.0f;
    const VkDeviceQueueCreateInfo queue = {.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                           .queueFamilyIndex = FAMILY,
                                           .queueCount = 1,
                                           .pQueuePriorities = &priority};
    const VkDeviceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                     .pNext = features_to_enable,
                                     .queueCreateInfoCount = 1,
                                     .pQueueCreateInfos = &queue,
                                     .pEnabledFeatures = &features};
    VK(vkCreateDevice(vk->physical, &info, NULL, &vk->device));
    vkGetDeviceQueue(vk->device, FAMILY, 0, &vk->queue);
    const VkCommandPoolCreateInfo pool = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                          .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT,
                                          .queueFamilyIndex = FAMILY};
    VK(vkCreateCommandPool(vk->device, &pool, NULL, &vk->pool));
}

static VkCommandBuffer make_commands(const Vulkan *vk) {
    const VkCommandBufferAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                              .commandPool = vk->pool,
                                              .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                              .commandBufferCount = 1};
    VkCommandBuffer cmd;
    VK(vkAllocateCommandBuffers(vk->device, &info, &cmd));
    return cmd;
}

static VkDeviceMemory allocate(const Vulkan *vk, VkMemoryRequirements needed, VkMemoryPropertyFlags wanted) {
    VkPhysicalDeviceMemoryProperties properties;
    vkGetPhysicalDeviceMemoryProperties(vk->physical, &properties);
    for (uint32_t i = 0; i < properties.memoryTypeCount; i++) {
        if ((needed.memoryTypeBits >> i & 1) && (properties.memoryTypes[i].propertyFlags & wanted) == wanted) {
            const VkMemoryAllocateInfo info = {
                .sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .allocationSize = needed.size, .memoryTypeIndex = i};
            VkDeviceMemory memory;
            VK(vkAllocateMemory(vk->device, &info, NULL, &memory));
            return memory;
        }
    }
    fprintf(stderr, "no memory of the kind that is needed\n");
    exit(1);
}

static Image make_image(const Vulkan *vk, VkFormat format, VkImageAspectFlags aspect, VkImageUsageFlags usage) {
    Image made = {.aspect = aspect};
    const VkImageCreateInfo info = {.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
                                    .imageType = VK_IMAGE_TYPE_2D,
                                    .format = format,
                                    .extent = {WIDTH, HEIGHT, 1},
                                    .mipLevels = 1,
                                    .arrayLayers = 1,
                                    .samples = VK_SAMPLE_COUNT_1_BIT,
                                    .usage = usage};
    VK(vkCreateImage(vk->device, &info, NULL, &made.image));
    VkMemoryRequirements needed;
    vkGetImageMemoryRequirements(vk->device, made.image, &needed);
    made.memory = allocate(vk, needed, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    VK(vkBindImageMemory(vk->device, made.image, made.memory, 0));
    const VkImageViewCreateInfo view = {.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
                                        .image = made.image,
                                        .viewType = VK_IMAGE_VIEW_TYPE_2D,
                                        .format = format,
                                        .subresourceRange = {aspect, 0, 1, 0, 1}};
    VK(vkCreateImageView(vk->device, &view, NULL, &made.view));
    return made;
}

static Buffer make_buffer(const Vulkan *vk, VkDeviceSize size, VkBufferUsageFlags usage) {
    Buffer made;
    const VkBufferCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = size, .usage = usage};
    VK(vkCreateBuffer(vk->device, &info, NULL, &made.buffer));
    VkMemoryRequirements needed;
    vkGetBufferMemoryRequirements(vk->device, made.buffer, &needed);
    made.memory = allocate(vk, needed, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    VK(vkBindBufferMemory(vk->device, made.buffer, made.memory, 0));
    VK(vkMapMemory(vk->device, made.memory, 0, VK_WHOLE_SIZE, 0, &made.bytes));
    return made;
}

/* Records a full barrier between two layouts of an image. */
static void layout(VkCommandBuffer cmd, const Image *image, VkImageLayout from, VkImageLayout to) {
    const VkImageMemoryBarrier2 barrier = {.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2,
                                           .srcStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                                           .srcAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT,
                                           .dstStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                                           .dstAccessMask = VK_ACCESS_2_MEMORY_READ_BIT | VK_ACCESS_2_MEMORY_WRITE_BIT,
                                           .oldLayout = from,
                                           .newLayout = to,
                                           .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                           .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                           .image = image->image,
                                           .subresourceRange = {image->aspect, 0, 1, 0, 1}};
    const VkDependencyInfo info = {
        .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .imageMemoryBarrierCount = 1, .pImageMemoryBarriers = &barrier};
    vkCmdPipelineBarrier2(cmd, &info);
}

static void destroy_image(const Vulkan *vk, const Image *image) {
    vkDestroyImageView(vk->device, image->view, NULL);
    vkDestroyImage(vk->device, image->image, NULL);
    vkFreeMemory(vk->device, image->memory, NULL);
}

static void destroy_buffer(const Vulkan *vk, const Buffer *buffer) {
    vkDestroyBuffer(vk->device, buffer->buffer, NULL);
    vkFreeMemory(vk->device, buffer->memory, NULL);
}

/* What the program ends with: 0 if validation, where it was asked for, had nothing to say. */
static int destroy_vulkan(Vulkan *vk) {
    vkDestroyCommandPool(vk->device, vk->pool, NULL);
    vkDestroyDevice(vk->device, NULL);
    if (vk->validate) {
        const PFN_vkVoidFunction destroy = vkGetInstanceProcAddr(vk->instance, "vkDestroyDebugUtilsMessengerEXT");
        ((PFN_vkDestroyDebugUtilsMessengerEXT)destroy)(vk->instance, vk->messenger, NULL);
    }
    vkDestroyInstance(vk->instance, NULL);
    if (vk->validate) {
        printf("validation: %d messages\n", vk->messages);
    }
    return vk->messages > 0;
}

#endif
